"""A servo: a position loop in firmware, a chopper averaged away, a DC motor and a gear inside the joint."""

from typing import Annotated, Any, ClassVar, Literal

import mujoco
import numpy as np
from pydantic import Field

from idbench.sim.drives.drive import AbstractAmplifier, AbstractDrive, Commanded, Electric, Trace, every
from idbench.sim.drives.pwm import Profile, within
from idbench.sim.errors import ScenarioError
from idbench.sim.robot.motors import Array
from idbench.sim.robot.robot import Robot
from idbench.sim.robot.servos import SHARP_FRICTION
from idbench.sim.settings import (
    EachNotNegative,
    EachNotNegativeOrNone,
    EachPositive,
    EachPositiveOrNone,
    NotNegative,
    Number,
    Positive,
    Whole,
    per_joint,
    settings,
)

Interval = tuple[NotNegative, NotNegative]


@settings
class ServoDrive(AbstractDrive):
    """Position-controlled joint: duty = clip(gain kp (q_s - q - lead qd), limit), V duty = R i + K qd, torque = K i.

    q_s follows the command within a rate and an acceleration. R and K are those behind the gear: kt = ke = K. Firmware runs as
    fast as the physics. With backlash, rotor and link are two bodies (see `idbench.sim.engine.geared_plant`).
    """

    commands: ClassVar[Commanded] = "position"
    has_own_motors: ClassVar[bool] = True

    torque_constant: EachPositive = (2.05,)
    """K, torque per ampere behind the gear and back-EMF per speed [N m/A], of all joints or of each."""
    resistance: EachPositive = (3.33,)
    """R of the winding [ohm], of all joints or of each."""
    armature: EachNotNegativeOrNone = None
    """Ia, inertia of the rotor behind the gear [kg m^2], of all joints or of each; without it the robot's own."""
    gain: Positive = 0.166
    """Duty per unit of kp and rad."""
    kp: EachPositive = (16.0,)
    """Gain of the firmware, of all joints or of each."""
    lead: NotNegative = 0.0
    """Derivative gain over gain kp [s]."""
    supply: Positive = 12.0
    """V, supply [V]."""
    duty_limit: Annotated[Number, Field(gt=0, le=1)] = 0.97
    """Largest duty."""
    current_limit: EachPositiveOrNone = None
    """Largest current [A], of all joints or of each."""
    rate: Positive | None = 4.7
    """Rate limit of the firmware's target [rad/s]; without it none."""
    acceleration: Positive | None = None
    """Acceleration limit of the firmware's target [rad/s^2]; without it none."""
    dead_band: NotNegative = 0.0
    """Error below which there is no duty, and by which larger ones count less [rad]."""
    counts: Annotated[Whole, Field(ge=0)] = 4096
    """Counts a turn of the position that the firmware sees; 0 is exact."""
    backlash: EachNotNegative = (0.0,)
    """Free play between rotor and link [rad], of all joints or of each."""
    sensed: Literal["link", "rotor"] = "link"
    """Where the encoder is: behind the gear or before it."""
    off: tuple[Interval, ...] = ()
    """From when to when torque is off [s]."""
    winding: Literal["open", "shorted"] = "open"
    """What the winding is then: open, or shorted, where back-EMF brakes."""

    def __post_init__(self) -> None:
        if wrong := [each for each in self.off if each[0] >= each[1]]:
            raise ScenarioError(f"off = {[list(x) for x in wrong]}: torque is off from one instant to a later one")

    def start(self, robot: Robot, nsim: int, h: float) -> AbstractAmplifier:
        """Return the servos, which hold where they are."""
        return _Amplifier(self, robot.n, nsim, h)

    def edit(self, spec: mujoco.MjSpec) -> None:
        """Write the armature into the joints, and make their friction as sharp as the step allows."""
        for joint in spec.joints:
            joint.solref_friction, joint.solimp_friction = list(SHARP_FRICTION[0]), list(SHARP_FRICTION[1])
        if self.armature is not None:
            for joint, Ia in zip(spec.joints, per_joint(self.armature, len(spec.joints), "drive.armature"), strict=True):
                joint.armature = Ia

    def lag(self, robot: Robot) -> Array:
        """Return zeros: the current that is measured is that of the instant."""
        return np.zeros(robot.n)

    def play(self, robot: Robot) -> Array:
        """Return the backlash [rad]."""
        return per_joint(self.backlash, robot.n, "drive.backlash")

    def conditions(self, t: Array, command: Array) -> dict[str, Array]:
        """Return commands, and whether torque is on, if it ever is not."""
        return {"command": command} | ({"on": 1.0 - self.is_off(t)[:, None]} if self.off else {})

    @property
    def before_gear(self) -> bool:
        """Whether the encoder is at the rotor."""
        return self.sensed == "rotor"

    def is_off(self, t: Any) -> Any:
        """True if torque is off at an instant, or at instants [s]."""
        off: Any = False
        for first, last in self.off:
            off = off | ((first <= t) & (t < last))
        return off


class _Amplifier(AbstractAmplifier):
    def __init__(self, settings: ServoDrive, n: int, nsim: int, h: float) -> None:
        def each(values: tuple[float, ...], name: str) -> Array:
            return every(per_joint(values, n, f"drive.{name}"), nsim)

        self._settings = settings
        self._h = h
        self._t = h / 2  # in the middle of the step to come
        self._K, self._R = each(settings.torque_constant, "torque_constant"), each(settings.resistance, "resistance")
        self._gain = settings.gain * each(settings.kp, "kp")
        self._most = each(settings.current_limit or (np.inf,), "current_limit")
        self._target = Profile(settings.rate or np.inf, settings.acceleration or np.inf, h)
        self._q: Array = np.zeros((1, nsim, n))

    def sees(self, q: Array) -> None:
        self._q = q

    def step(self, demand: Array, speed: Array, steps: int) -> Array:
        done = [self._once(demand, self._q[k % len(self._q)], speed[k % len(speed)]) for k in range(steps)]
        # Most calls are of one step, where a view does.
        self.trace = tuple(x[0][None] if steps == 1 else np.stack(x) for x in zip(*done, strict=True))
        return self._K * self.trace[1]

    def _once(self, command: Array, q: Array, qd: Array) -> tuple[Array, ...]:
        """Return duty, current, back-EMF and whether a limit holds, in one step."""
        s = self._settings
        target = self._target.follow(command)
        on = not s.is_off(self._t)
        self._t += self._h
        step = 2 * np.pi / s.counts if s.counts else 0.0
        seen = np.rint(q / step) * step if step else q
        error = target - seen - s.lead * qd
        if s.dead_band:
            error = error - within(error, s.dead_band)
        asked = self._gain * error * on
        duty = within(asked, s.duty_limit)
        emf = self._K * qd
        driven = on or s.winding == "shorted"
        wanted = driven * (s.supply * duty - emf) / self._R
        current = within(wanted, self._most)
        limited = (np.abs(asked) > s.duty_limit) | (np.abs(wanted) > self._most)
        return duty, current, emf, limited.astype(np.float64), self._R * current + emf

    def electric(self, trace: Trace, dt: Array) -> Electric:
        duty, current, emf, limited, voltage = trace
        return Electric(current, current, voltage, duty, limited, emf)
