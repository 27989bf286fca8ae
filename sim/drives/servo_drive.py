"""A servo: a position loop in firmware, a chopper averaged away, a DC motor and a gear inside the joint."""

from typing import Annotated, Any, ClassVar, Literal

import mujoco
import numpy as np
from pydantic import Field

from idbench.sim.drives.drive import AbstractAmplifier, AbstractCompiledAmplifier, AbstractDrive, Commanded, Electric, Trace
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
        n, off = robot.n, np.array(self.off, dtype=np.float64)

        def each(name: str, values: tuple[float, ...] | None) -> Array:
            return per_joint(values or (np.inf,), n, f"drive.{name}")

        names = "torque_constant", "resistance", "kp", "current_limit"
        K, R, kp, most = (each(name, getattr(self, name)) for name in names)
        step = 2 * np.pi / self.counts if self.counts else 0.0
        firmware = self.rate or np.inf, self.acceleration or np.inf, self.lead, self.dead_band, self.duty_limit
        rows = K, R, self.gain * kp, most, *firmware, self.supply, step, self.winding == "shorted", len(off), np.nan, 0.0, h / 2
        return _Amplifier("servo_drive", (nsim, n), rows, h, signals=(off[None] if self.off else None,))

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


class _Amplifier(AbstractCompiledAmplifier):
    """Its firmware runs in every physics step."""

    signals: ClassVar[int] = 5

    def electric(self, trace: Trace, dt: Array) -> Electric:
        duty, current, emf, limited, voltage = trace
        return Electric(current, current, voltage, duty, limited, emf)
