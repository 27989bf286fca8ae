"""What is known of the loop that drives a joint: its firmware, its supply, its encoder."""

from dataclasses import dataclass, fields
from typing import NamedTuple

import numpy as np

from idbench.identify.errors import SettingError, require_positive

EXACT = 2**24  # Counts a turn from which on rounding is below that of the numbers in a log
FREE = ("kind", "kp", "kd", "time_constant", "steps")  # What need not be above zero
HIGHEST = 1500.0  # Supply [V] above which millivolts are suspected: low voltage (IEC 61140) ends there for direct current


class LoopKind(NamedTuple):
    """In what a loop commands."""

    limit: str
    """What servo.toml calls its limit."""
    held: dict[str, float]
    """Parameters that are known of it unless something else is asked for."""
    unit: str
    """Unit of the torque per command, a."""


KINDS: dict[str, LoopKind] = {
    "duty": LoopKind("duty_limit", {}, "N m/V"),
    "torque": LoopKind("torque_limit", {"a": 1.0, "b": 0.0}, "1"),
    "current": LoopKind("current_limit", {"b": 0.0}, "N m/A"),
}
"""What a loop may command: the duty of a chopper before a DC motor, a torque, or a current, which needs no back-EMF."""


class TimeSteps(NamedTuple):
    """What an integrator of finite steps makes of a joint: damping that it takes late in a step acts as inertia."""

    joint: float = 0.0
    """Inertia per damping of the joint [s]."""
    loop: float = 0.0
    """Inertia per damping of the loop [s]."""
    early: float = 0.0
    """By how much commands act before they are logged [s]."""
    step: float = 0.0
    """Step of the integrator [s]; 0: a real joint."""
    yielding: float = 0.0
    """R, acceleration of a joint at rest per torque of its dry friction [1/(kg m^2)]."""
    decay: float = 0.0
    """B, rate at which that friction slows what still moves [1/s]; 0: friction is as sharp as that of a joint."""


class Published(NamedTuple):
    """A servo that others measured."""

    gain: float
    """Duty per unit of kp and rad."""
    duty_limit: float
    """Largest duty."""
    counts: int
    """Counts a turn."""
    supply: float
    """Largest supply of its datasheet [V]."""


PUBLISHED: dict[str, Published] = {
    "STS3215": Published(0.166, 0.97, 4096, 14.0),
    "MX-64": Published(0.158, 0.9625, 4096, 14.8),
    "MX-106": Published(0.158, 0.9625, 4096, 14.8),
    "XL-320": Published(0.0505, 1.0, 1024, 8.4),
    "XL330": Published(4096 / (2 * np.pi * 256 * 885), 1.0, 4096, 6.0),
}
"""Gain, largest duty and counts as published with BAM (arXiv 2410.08650, measured with an oscilloscope) and for the STS3215 at
GitHub kscalelabs/sysid; supplies by the makers' datasheets."""


@dataclass(frozen=True)
class Servo:
    """What is known of the loop that drives a joint.

        tau = a V sat(gain kp (q_s - q) - kd qd + forward) - b qd

    with q_s the command after a delay, a rate limit and a low-pass. V is the supply of a `duty`, and 1 of a `torque` or a
    `current`.

    Raises
    ------
    SettingError
        If a value is out of its range.
    """

    gain: float = 1.0
    """Duty, torque [N m] or current [A] per unit of kp and rad of position error."""
    kp: float = 1.0
    """Gain of the firmware; 0: it controls velocities."""
    supply: float = 1.0
    """V [V]. At 1, a is the torque at full duty."""
    limit: float = np.inf
    """Largest duty, torque [N m] or current [A]."""
    counts: int = EXACT
    """Counts of the encoder a turn; from `EXACT` on, positions are not rounded."""
    kd: float = 0.0
    """Duty, torque or current per speed [rad/s], within the limit."""
    speed_limit: float = np.inf
    """Speed at which the limit has fallen to nothing [rad/s], linearly, as of a DC motor behind a current limit."""
    time_constant: float = 0.0
    """That of a low-pass of the command [s]; 0: there is none."""
    kind: str = "duty"
    """What it commands (see `KINDS`)."""
    steps: TimeSteps = TimeSteps()  # noqa: RUF009  # immutable
    """What the integrator of a simulation makes of it; nothing for a real joint."""

    def __post_init__(self) -> None:
        if self.kind not in KINDS:
            raise SettingError(f"kind = {self.kind!r} is unknown; known: {', '.join(KINDS)}")
        above = {field.name: getattr(self, field.name) for field in fields(self) if field.name not in FREE}
        finite = {name: x for name, x in above.items() if not (name in ("limit", "speed_limit") and x == np.inf)}
        require_positive(**{KINDS[self.kind].limit if name == "limit" else name: x for name, x in finite.items()})
        if not (np.isfinite(self.kd) and min(self.kp, self.time_constant) >= 0 and max(self.kp, self.time_constant) < np.inf):
            stated = f"kp = {self.kp:g}, time_constant = {self.time_constant:g}, kd = {self.kd:g}"
            raise SettingError(f"{stated}: all must be finite, and only kd may be negative")
        if not self.kp and not self.kd > 0:
            raise SettingError("kp or kd must be above 0: a loop without gains does not respond to its command")
        if self.kind == "duty" and not self.limit <= 1:
            if self.limit != np.inf:
                raise SettingError(f"duty_limit = {self.limit:g} must be at most 1, the whole supply")
            object.__setattr__(self, "limit", 1.0)
        if self.supply > HIGHEST:
            raise SettingError(f"supply = {self.supply:g} V is impossible: is it stated in millivolts? 12 V are supply = 12.0")
        if self.kind != "duty" and self.supply != 1:
            raise SettingError(f"supply = {self.supply:g}: a loop of kind {self.kind!r} has none; leave it out")

    @property
    def slope(self) -> float:
        """Duty, torque or current per rad."""
        return self.gain * self.kp

    @property
    def count(self) -> float:
        """Angle to whose multiples the firmware rounds [rad]; 0: it does not."""
        return 2 * np.pi / self.counts if self.counts < EXACT else 0.0

    @property
    def held(self) -> dict[str, float]:
        """Parameters that are known of its kind."""
        return KINDS[self.kind].held | ({"lag": self.time_constant} if self.time_constant else {})
