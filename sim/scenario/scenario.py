"""Everything that defines a run, from TOML or Python."""

from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from idbench.identify.data.motion_log import TorqueChannel
from idbench.sim.controllers import AbstractController, PDFeedforward
from idbench.sim.drives import AbstractDrive, IdealDrive
from idbench.sim.encoders import AbstractEncoder, ExactEncoder
from idbench.sim.errors import ScenarioError
from idbench.sim.frictions import AbstractFrictionLaw, CoulombViscous
from idbench.sim.robot.payload import Payload
from idbench.sim.robot.robot import Robot
from idbench.sim.scenario.faults import FAULTS, Fault
from idbench.sim.scenario.measurement import Ripple, TorqueMeasurement
from idbench.sim.settings import NotNegative, Number, Positive, Seed, settings
from idbench.sim.trajectories import AbstractTrajectory, Quintic


@settings
class Timing:
    """When things happen."""

    delay: NotNegative = 0.0
    """Computing delay: from a sample to the instant its command acts [s]; below 1 s."""
    jitter: NotNegative = 0.0
    """Sample instants scatter evenly over this width around the instant that the log claims [s]."""
    refresh: NotNegative = 0.0
    """Period at which the position that is read is renewed [s]: samples are up to that old, and those between repeat."""

    def __post_init__(self) -> None:
        if self.delay >= 1:
            raise ScenarioError(f"delay = {self.delay:g} s must be below 1 s")


@settings
class Physics:
    """How the plant is integrated."""

    step: Annotated[Number, Field(gt=0, le=0.01)] = 0.001
    """Longest physics step [s]; the drive may need a shorter one."""
    integrator: Literal["RK4", "implicitfast", "implicit", "Euler"] = "RK4"
    """MuJoCo's integrator. All but RK4 act half a step early, which the log's torque delay states."""

    @property
    def early(self) -> float:
        """Share of a step by which torques act early."""
        return 0.0 if self.integrator == "RK4" else 0.5


@settings
class Scenario:
    """A robot, a motion, and all that is imperfect about them."""

    name: Annotated[str, Field(pattern=r"^\w[\w .-]*$")]
    """Name of the run: letters, digits, space, dot, hyphen and underscore."""
    trajectory: AbstractTrajectory
    """Where the joints shall go: a table with a kind, or the name of a scenario whose trajectory it takes."""
    robot: str = "scara"
    """Name of a robot that ships, or path of an MJCF or URDF file."""
    fs: Positive = 100.0
    """Sampling frequency of controller and log [Hz]."""
    seed: Seed = 0
    """Seed of whatever is random in it."""
    origin: str = ""
    """Where it comes from."""
    start: tuple[Number, ...] = ()
    """Positions [rad] from which the arm is brought to the trajectory, before the log begins; empty: it is there."""
    controller: AbstractController = PDFeedforward()
    """What commands the torques."""
    timing: Timing = Timing()
    """When things happen."""
    drive: AbstractDrive = IdealDrive()
    """What makes torque of a command."""
    ripple: Ripple = Ripple()
    """Torque that depends on the rotor's position."""
    friction: AbstractFrictionLaw = CoulombViscous()
    """How the joints resist."""
    payload: Payload = Payload()
    """A mass that the controller does not know."""
    encoder: AbstractEncoder = ExactEncoder()
    """What measures the positions."""
    torque: TorqueMeasurement = TorqueMeasurement()
    """What the log's torque is made of."""
    physics: Physics = Physics()
    """How the plant is integrated."""
    fault: tuple[Fault, ...] = ()
    """What is wrong with the robot or its log, one [[fault]] after the other."""
    severity: Positive = 1.0
    """By what the sizes of all faults are multiplied; of saturation what is cut off."""

    def __post_init__(self) -> None:
        if self.drive.commands != self.controller.commanded:
            raise ScenarioError(
                f"this controller commands a {self.controller.commanded}, this drive takes a {self.drive.commands}: a drive of "
                "kind servo needs a controller of kind position, and the other way round"
            )
        if self.drive.commands == "position" and self.torque.source == "reference":
            raise ScenarioError("the torque of a servo is commanded by nobody: torque.source must be 'current'")
        if self.severity != 1 and not any(FAULTS[fault.kind].unit for fault in self.fault):
            raise ScenarioError(f"severity = {self.severity:g} has no effect: no fault of the scenario has a size")
        _ = self.faults

    @property
    def faults(self) -> tuple[Fault, ...]:
        """The faults as large as they are."""
        return tuple(fault.times(self.severity) for fault in self.fault)

    @property
    def real_robot(self) -> Robot:
        """The robot that is simulated: with its payload, and the friction of the scenario."""
        return Robot.load(self.robot, self.payload.edit, self.friction.edit, self.drive.edit)

    @property
    def nominal_robot(self) -> Robot:
        """The robot as its maker describes it."""
        return Robot.load(self.robot)

    @property
    def imperfections(self) -> list[str]:
        """The parts of the scenario that are not ideal."""
        ideal = Scenario("ideal", self.trajectory, self.robot)
        parts = ("drive", "ripple", "encoder", "torque", "friction", "timing", "payload", "fault")
        return [part for part in parts if getattr(self, part) != getattr(ideal, part)]

    @property
    def wdyn(self) -> float | None:
        """The bandwidth of the position loop, that of its fastest joint [Hz]; None where the controller closes none."""
        w = self.controller.wdyn
        return None if w is None else w / (2 * np.pi)

    @property
    def channel(self) -> TorqueChannel:
        """What the torque in the log means."""
        lag = float(self.drive.lag(self.real_robot).mean())
        early = self.physics.early * self.drive.step_length(self.fs, self.physics.step)
        return self.torque.channel(self.timing.delay, lag - early, self.fs)

    def quintic(self) -> Quintic:
        """Return the trajectory if it is given by waypoints and times; raise ScenarioError if not."""
        if not isinstance(self.trajectory, Quintic):
            raise ScenarioError(f"scenario {self.name!r}: only a trajectory of kind quintic is possible here")
        return self.trajectory
