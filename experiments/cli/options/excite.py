"""Options of `idbench excite`."""

from dataclasses import dataclass, field
from typing import Annotated, final

import tyro

from idbench.experiments.cli.app import command
from idbench.experiments.cli.command import Command
from idbench.experiments.cli.options.shared import Asked, RecordedOptions
from idbench.experiments.identification.parameters import Parameters
from idbench.experiments.option_types import Each, File, Files, Folder, Real, Scenario

Weights = Annotated[tuple[str, ...], tyro.conf.arg(metavar="NAME=WEIGHT", help_behavior_hint="")]
Percent = Annotated[str | None, tyro.conf.arg(metavar="PERCENT", help_behavior_hint="")]


@command("excite")
@final
@dataclass(frozen=True)
class Excite(RecordedOptions, Command, action="excite:excite"):
    """Design an exciting trajectory within the robot's limits."""

    robot: tyro.conf.Positional[str]
    """Name of a shipped robot, or its file (MJCF or URDF)."""
    duration: float = 10.0
    """Duration of the motion [s], without the moves from and to home and the rest."""
    kind: str = "fourier"
    """fourier: a finite Fourier series; moves: fifth-order point-to-point moves; or a plug-in (idbench list)."""
    frequency: float = 1.0
    """Highest frequency of the series, or moves per second [Hz]."""
    repeat: int = 1
    """How often the motion is repeated."""
    log: Files = ()
    """Earlier logs of the robot, whose information is taken into account."""
    noise: Scenario = None
    """Scenario (name, or TOML file) that states encoders, torque noise and drive."""
    encoder_bits: Real = None
    """Resolution of the encoders per turn [bits]. Default: that of --noise, or 17."""
    torque_noise: Each = ()
    """White torque noise, rms [N m], for all joints or for each. Default: that of --noise, or 0.05."""
    fs: Real = None
    """Sampling frequency of controller and log [Hz]. Default: that of --noise, or 100."""
    limits: File = None
    """Limits of the motion (TOML): ranges, velocities, torques, boxes around the robot. Default: those of the robot's file."""
    velocity: Each = ()
    """Largest speed [rad/s, m/s], for all joints or for each. Overrides --limits and the file. MJCF files usually have none."""
    acceleration: Each = ()
    """Largest acceleration [rad/s^2, m/s^2], for all joints or for each."""
    weigh: Weights = ()
    """Weights of parameters in the mean of ln sigma, such as LMY2=4."""
    criterion: str = "sigma"
    """sigma: the mean of ln sigma, after the determinant; determinant: only that; for comparison: condition, birdy,
    smallest."""
    until: Percent = None
    """Design, run and identify motions on the simulated robot until one sigma of each parameter contributes less than this
    share of a brisk motion's torque, such as 0.1%."""
    seed: int = 0
    """Seed of random motions and of the search. The same seed gives the same motion."""
    out: Folder = field(default=None, kw_only=True)
    """Folder for motion.csv, scenario.toml, summary.json, report.html and recording.rrd. Default: runs/excited-<robot>."""
    parameters: Asked = Parameters()  # noqa: RUF009  # frozen
    """Which parameters are identified."""
