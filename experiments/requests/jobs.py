"""The requests, one a job: what Python, the command line, studies and files of sets can ask for."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

from idbench.experiments.requests import words
from idbench.experiments.requests.shared import CHAIN, ESTIMATOR, LogRequest, MountingOptions, Parameters
from idbench.experiments.requests.words import Word


@dataclass(frozen=True)
class IdentifyRequest(LogRequest):
    """Identify a log, or several logs in one fit."""

    log: words.Logs = ()
    """Log files: CSV and other text, Parquet, NumPy, Matlab, ROS bags. Times must be uniform to 1 %, otherwise use --resample.
    Or the folder of a run; its recording gets a layer of this identification."""
    chain: str = CHAIN
    """Chain of signal processing, or MODULE:NAME of your own."""
    chain_file: words.File = None
    """TOML file with settings of the chain: chain = "idbench", then tables such as [operator] with cutoff = 20.0."""
    model: str | None = None
    """explicit, implicit, power, energy (power over windows), integral (implicit over windows), all, or MODULE:CLASS of your
    own. Default: the first three; for robots of many joints the screen shows the best one."""
    wdyn: float | None = None
    """Bandwidth of the position loop [Hz]; sampling and filter frequencies are printed as multiples of it. Default: that of
    the controller of a run's folder, else the bandwidth of the motion."""
    loop: Annotated[tuple[str, ...], Word("SCENARIO", file="name")] = ()
    """Scenario of the control loop of each log, for IV, DIDIM, CLIE and CLOE: robot, motion, controller, timing, drive.
    Default: that of the run's folder."""
    start: words.Start = "least-squares"
    """Where estimators that simulate or filter start: at the least-squares estimate, or at the robot's file."""
    validate: words.Files = ()
    """Held-out logs on which the result is validated. Default: the last quarter of the log, predicted by a fit of the rest."""
    label: str = ""
    """Name of this identification in a recording. Default: chain and estimator."""
    no_trials: Annotated[bool, Word(flag=True)] = False
    """Try no other options on held-out data where the result is not good."""


@dataclass(frozen=True)
class KnownOptions:
    """What is known of the payload."""

    mass: words.Real = None
    """Its mass [kg]."""
    at: words.Vector = None
    """Its centre of mass in the frame of the last link [m]."""
    inertia: Annotated[tuple[float, float, float, float, float, float] | None, Word("XX YY ZZ XY XZ YZ")] = None
    """Its inertia about the centre of mass, in the axes of that frame [kg m^2]."""


@dataclass(frozen=True)
class LoadRequest(LogRequest):
    """Logs of a robot with a payload, and without it."""

    log: words.Logs = ()
    """Logs with the payload."""
    unloaded: words.Files = ()
    """Logs without the payload."""
    known: KnownOptions = KnownOptions()  # frozen


@dataclass(frozen=True)
class PayloadRequest(LoadRequest):
    """Identify what the gripper holds."""

    before: words.File = None
    """A robot identified earlier (`idbench identify --write FILE.json`), instead of logs without the payload."""
    way: Literal["together", "fixed"] = "together"
    """together: all logs in one fit; fixed: first the robot, then the payload."""
    gain_sigma: words.Each = ()
    """Standard deviation of the torque constants, as a share of them (0.01 is 1 %), of all joints or of each: it becomes part
    of that of the payload, in which a wrong torque constant looks like mass."""


@dataclass(frozen=True)
class GainsRequest(LoadRequest):
    """Identify the torque constants of the drives, gears included, with a payload of known mass."""


@dataclass(frozen=True)
class ServoRequest:
    """Identify joints under position loops (servos, legs, MuJoCo's actuators) from commands and positions alone."""

    log: words.Logs = ()
    """Logs of commands and positions: columns t, q1, ..., command1, ... in SI units; on1, ..., voltage1, ... if logged."""
    robot: words.Robot = None
    """Name of a shipped robot, or its file: MJCF or URDF. Its links, a known mass included, set the scale of all torques."""
    servo: words.File = None
    """servo.toml: model = "STS3215", kp, supply; or kind = "torque", kp, kd, torque_limit; [joints.NAME] and [logs."FILE"] for
    what differs. By default what the actuators of the robot's file state."""
    simulated: bool = False
    """Logs are of a MuJoCo simulation of the file: its integrator is taken into account."""
    friction: Annotated[str, Word("LAW")] = "load"
    """Friction law: coulomb, stribeck, load, load-stribeck, directional, quadratic, gear; auto compares them, and takes the
    simplest that no other predicts significantly better."""
    find: Annotated[tuple[str, ...], Word("LETTER")] = ()
    """Further parameters to be found: lag, lead, dead_band, backlash, gain_error, scale_error, zero, bias, Mg, Fo; a of a loop
    that commands torques."""
    hold: words.Texts = ()
    """Known parameters, of all joints or of one: Ia=0.02 wrist_roll.a=0.5 (N m/V)."""
    tie: Annotated[tuple[str, ...], Word("JOINT,JOINT")] = ()
    """Joints with the same motor, one word a motor: '*_hip' 'knee_left,knee_right'."""
    columns: words.Texts = ()
    """Names of columns: q=position_* command=goal_* on=torque_enable (* stands for numbers or names of joints)."""
    units: words.Texts = ()
    """Units: t=ms q=deg command=deg."""
    rows: words.Texts = ()
    """Use only rows in which columns have these values: episode_index=3."""
    mounting: MountingOptions = MountingOptions()  # noqa: RUF009  # frozen
    validate: words.Files = ()
    """Held-out logs, simulated from their commands alone. Default: the last log, where there are several."""


@dataclass(frozen=True)
class ExciteRequest:
    """Design an exciting trajectory within the robot's limits."""

    robot: words.ThisRobot
    """Name of a shipped robot, or its file (MJCF or URDF)."""
    duration: float = 10.0
    """Duration of the motion [s], without the moves from and to home and the rest."""
    kind: str = "fourier"
    """fourier: a finite Fourier series; moves: fifth-order point-to-point moves; or a plug-in (idbench list)."""
    frequency: float = 1.0
    """Highest frequency of the series, or moves per second [Hz]."""
    repeat: int = 1
    """How often the motion is repeated."""
    log: words.Files = ()
    """Earlier logs of the robot, whose information is taken into account."""
    noise: words.Scenario = None
    """Scenario (name, or TOML file) that states encoders, torque noise and drive."""
    encoder_bits: words.Real = None
    """Resolution of the encoders per turn [bits]. Default: that of --noise, or 17."""
    torque_noise: words.Each = ()
    """White torque noise, rms [N m], for all joints or for each. Default: that of --noise, or 0.05."""
    fs: words.Real = None
    """Sampling frequency of controller and log [Hz]. Default: that of --noise, or 100."""
    limits: words.File = None
    """Limits of the motion (TOML): ranges, velocities, torques, boxes around the robot. Default: those of the robot's file."""
    velocity: words.Each = ()
    """Largest speed [rad/s, m/s], for all joints or for each. Overrides --limits and the file. MJCF files usually have none."""
    acceleration: words.Each = ()
    """Largest acceleration [rad/s^2, m/s^2], for all joints or for each."""
    weigh: Annotated[tuple[str, ...], Word("NAME=WEIGHT")] = ()
    """Weights of parameters in the mean of ln sigma, such as LMY2=4."""
    criterion: str = "sigma"
    """sigma: the mean of ln sigma, after the determinant; determinant: only that; for comparison: condition, birdy,
    smallest."""
    until: Annotated[str | None, Word("PERCENT")] = None
    """Design, run and identify motions on the simulated robot until one sigma of each parameter contributes less than this
    share of a brisk motion's torque, such as 0.1%."""
    seed: int = 0
    """Seed of random motions and of the search. The same seed gives the same motion."""
    parameters: Parameters = Parameters()  # noqa: RUF009  # frozen


@dataclass(frozen=True)
class RunRequest:
    """Simulate a scenario in closed loop, and identify it."""

    scenario: words.ThisScenario = None
    """Name of a shipped scenario, or its file (TOML)."""
    chain: str = CHAIN
    """Chain of signal processing, or MODULE:NAME of your own."""
    estimator: str = ESTIMATOR
    """GLS, ML, ML-delay, ML-reversals, OLS, OLS-selected, WLS, IRLS, TLS, RLS, IV, DIDIM, CLIE, CLOE, OE, UKF, or a plug-in;
    see docs/estimators.md."""
    start: words.Start = "least-squares"
    """Where estimators that simulate or filter start: at the least-squares estimate, or at the robot's file."""
    study: Annotated[Path | None, Word("DIR", option="from")] = None
    """Repeat one run of a study, given by its folder, instead of a scenario."""
    index: words.Count = None
    """Number of that run. Its rows must have the same bits."""
    method: words.Count = None
    """Which of the study's combinations of chain, estimator and settings is shown. Default: the first."""
    robot: words.Robot = None
    """Another robot: name of a shipped one, or a file (MJCF or URDF). A trajectory that does not fit it is replaced by random
    moves."""
    parameters: Parameters = Parameters()  # noqa: RUF009  # frozen


@dataclass(frozen=True)
class StudyRequest:
    """Simulate a scenario over a grid and many seeds, and identify each run."""

    study: Annotated[str | None, Word("STUDY", positional=True, file="name")] = None
    """Name of a shipped study, or its file (TOML)."""
    resume: words.Folder = None
    """Folder of an interrupted study: run what is missing, and make the report again."""
    seeds: words.Count = None
    """Independent runs per combination, instead of the study's number."""
    shard: words.Count = None
    """Largest number of runs simulated together. Results do not depend on it."""
    threads: words.Count = None
    """Shards at a time. Default: all processors."""
    workers: words.Count = None
    """Run in this number of processes instead (extra `cluster`)."""
    scheduler: words.Url = None
    """Run on a Dask scheduler instead, such as tcp://host:8786 (extra `cluster`)."""


@dataclass(frozen=True)
class Table1Request:
    """Reproduce the paper's simulation comparison."""

    chain: str = "all"
    """Chain of signal processing: all, or one by name (paper, paper_masked, idbench, ...)."""
    motions: words.Count = None
    """Show the errors over this number of random motions of the paper's class (runs/table1-motions). 2000 take about ten
    minutes."""
    seed: words.Count = None
    """Search another trajectory from this seed."""
    scenario: words.Scenario = None
    """Another scenario: a name, or a file (TOML) as `idbench search` writes it."""


@dataclass(frozen=True)
class Table2Request:
    """Repeat the paper's experiment on the virtual robot, and attribute its errors."""

    scenario: str = "table2"
    """Name of a scenario, or a file (TOML)."""


def request_type(asked: Any) -> type:
    """Class of a request, of which the options of a command may be a subclass."""
    return next(kind for kind in type(asked).__mro__ if kind.__module__ == __name__)
