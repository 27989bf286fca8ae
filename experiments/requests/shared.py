"""What requests of several jobs have in common: columns of a log, the mounting of a robot, its parameters."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Literal

from idbench.experiments.requests.words import Delay, Each, File, Hertz, Joints, Names, Robot, Texts, Torque, Vector, Word

if TYPE_CHECKING:
    from idbench.sim.robot.mounting import Mounting

CHAIN, ESTIMATOR = "idbench", "GLS"
"""What is taken where nothing else is asked for, as `identify` has it; here, since the command line's help loads no more."""


@dataclass(frozen=True)
class Parameters:
    """Which parameters are identified."""

    armature: Literal["auto", "file", "all", "none"] = "auto"
    """Joints with a rotor inertia: those that have one in the robot's file, all, or none (torques measured at the links;
    reversals are then not masked). auto: as the file has it, and all where a file cannot state any (URDF, DH tables)."""
    add: Names = ()
    """Friction laws in addition to viscous and Coulomb friction, such as offset, a constant torque of each joint."""
    without: Names = ()
    """Parameters to leave out, as if they were zero."""
    hold: Annotated[tuple[str, ...], Word("NAME=VALUE")] = ()
    """Known parameters, which are not identified: Ia3=0.1 Fs2=file, and links=file, armatures=file, friction=file for all of
    a kind. Others are grouped without them: with known links each armature is a parameter of its own."""
    prior: Annotated[tuple[str, ...], Word("NAME=VALUE:TRUST")] = ()
    """Roughly known parameters: file, links near those of the robot's file and physically consistent (file:25%: as near as
    that; by default the log decides); Ia3=0.1:30%, Fs=file:20% (of all joints), armatures=file:30%, ZZR1=3:0.2 with a sigma."""
    tie: Annotated[tuple[str, ...], Word("NAME=NAME")] = ()
    """Parameters that are equal, such as those of the same motor in two joints: Ia1=Ia4 Fv1=Fv4."""
    friction: Annotated[tuple[str, ...], Word("[JOINT=]LAW+LAW")] = ("standard",)
    """Friction laws: standard (viscous and Coulomb), none (torques measured at the links), asymmetric, or a sum such as
    standard+load+stribeck; for one joint: 2=standard+load. auto chooses those that predict held-out stretches best; smooth adds
    smooth functions of velocity, of a size that the log decides, to standard+load, in seconds. `idbench
    list` lists them."""
    balancer: Annotated[tuple[str, ...], Word("JOINT=a:M,b:M,...")] = ()
    """Springs and gas springs between two points, by their geometry from a drawing, such as 2=a:0.2,b:0.8,zero:-1.66 with
    volume:0.58 for gas [m, rad]: F0, Kb and Fg are identified."""


@dataclass(frozen=True)
class ColumnOptions:
    """What the columns are."""

    layout: File = None
    """Another log.toml that describes the columns. `idbench log FILE --write` makes one."""
    columns: Texts = ()
    """Names of columns: t=time q=position_* tau=effort_* (* stands for numbers or names of joints; or a list with commas)."""
    units: Texts = ()
    """Units: t=ms q=deg tau=mNm, tau=A with --gain, q=count:131072@4194304 (counts of a turn, count at zero), tau=permille:2.4
    (of the rated torque, N m), tau=V (a model in volts)."""
    rows: Texts = ()
    """Use only rows in which columns have these values: episode_index=3."""
    gain: Each = ()
    """Torque per logged unit (N m/A): one for all joints, or one each."""
    resample: bool = False
    """Make times uniform: remove repeated rows, use a steady clock where stamps jitter, interpolate missing samples, split at
    gaps, use logged velocities where they are more accurate. Every step is reported."""
    simulated: bool = False
    """The log is of MuJoCo's simulation of the robot's file by the file's own actuators, joint torques (qfrc_actuator) logged
    before each step: what the integrator makes of damping is taken out. Default: where that is evident from the file."""
    samples: bool = False
    """Each row is a sample by itself, with q, qd and qdd (what is missing is 0): times do not count, nothing is filtered or
    differentiated. Default: a file without times that has accelerations is of samples."""
    poses: bool = False
    """Each row is a pose at rest, by itself: gravity alone is identified, by chain poses. Default: rows that are 0.5 s apart
    and do not continue each other are poses."""


@dataclass(frozen=True)
class MountingOptions:
    """How the robot is mounted."""

    joints: Joints = ()
    """Joints of the log, in the order of its columns, if the robot has more (grippers, mobile bases)."""
    lock: Annotated[tuple[str, ...], Word("JOINT=VALUE")] = ()
    """Joints that do not move, and their positions [rad, m]."""
    coupling: Annotated[tuple[str, ...], Word("NAME=JOINT+JOINT")] = ()
    """Drives whose motor turns with several joints, with rotor and friction of their own: motor6=joint_5+joint_6, or with
    factors, m2=a-0.5*b. In an MJCF file these are fixed tendons."""
    gravity: Vector = None
    """Gravity in the frame of the robot's base [m/s^2], for a base on a wall or ceiling. Default: the file's."""

    @property
    def mounting(self) -> "Mounting":
        """The mounting; RobotError if a lock or a coupling is none."""
        from idbench.sim.robot.mounting import Mounting, coupled, locked

        return Mounting(self.joints, locked(self.lock), self.gravity, coupled(self.coupling))


@dataclass(frozen=True, kw_only=True)
class LogRequest:
    """How logs are read and identified."""

    robot: Robot = None
    """Name of a shipped robot, or its file: MJCF, URDF, or a table of Denavit-Hartenberg parameters (.toml). Default: scara, or
    the robot of the run."""
    torque: Torque = None
    """What a torque sample means: held for one period from its sample on (a controller's command), the torque at that instant
    (a measurement), or the mean over the period. Required unless the file states it."""
    torque_delay: Delay = None
    """Delay from a sample to the torque that it stands for, in seconds; `estimate` finds it, `joints` one of each joint."""
    unwrap: bool = False
    """Unwrap 2 pi jumps of the angles."""
    reading: ColumnOptions = ColumnOptions()  # frozen
    mounting: MountingOptions = MountingOptions()  # frozen
    parameters: Parameters = Parameters()  # frozen
    mask_speed: Each = ()
    """Speed below which a joint counts as resting or reversing, for all joints or for each [rad/s, m/s]; such instants are
    masked. Default: 5 % of its rms speed or 4 times the noise of its velocity, and 2 or 4 times that where stretches left out
    are then predicted better."""
    cutoff: Hertz = None
    """Cut-off of the low-pass [Hz]. Default: 5, or what a short log needs."""
    estimator: str = ESTIMATOR
    """GLS, ML, ML-delay, ML-reversals, OLS, OLS-selected, WLS, IRLS, TLS, RLS, IV, DIDIM, CLIE, CLOE, OE, UKF, or a plug-in;
    see docs/estimators.md."""
