"""Options of `idbench excite`."""

from dataclasses import dataclass, field
from typing import Annotated, final

import tyro

from experiments.cli.app import command
from experiments.cli.command import Command
from experiments.cli.options.shared import Asked, RecordedOptions
from experiments.identification.parameters import Parameters
from experiments.option_types import Each, File, Files, Folder, Real, Scenario

Weights = Annotated[tuple[str, ...], tyro.conf.arg(metavar="NAME=WEIGHT", help_behavior_hint="")]
Percent = Annotated[str | None, tyro.conf.arg(metavar="PERCENT", help_behavior_hint="")]


@command("excite")
@final
@dataclass(frozen=True)
class Excite(RecordedOptions, Command, action="excite:excite"):
    """Design a motion that tells the parameters of a robot well, within its limits."""

    robot: tyro.conf.Positional[str]
    """Name of a robot that ships, or a file that describes it (MJCF or URDF)."""
    duration: float = 10.0
    """Time of the motion [s], without the ways from and to home, and rest."""
    kind: str = "fourier"
    """fourier: a finite Fourier series; moves: fifth-order point-to-point moves; or of a plug-in: idbench list."""
    frequency: float = 1.0
    """Highest frequency of the series, or moves a second [Hz]."""
    repeat: int = 1
    """Times that the motion is run, one after the other."""
    log: Files = ()
    """Earlier logs of the robot: what they tell need not be told again."""
    noise: Scenario = None
    """A scenario (name, or TOML file) whose encoders and torque noise are those of the log, and whose drive is simulated."""
    encoder_bits: Real = None
    """Resolution of the encoders, a turn [bits]; that of the scenario of --noise, or 17."""
    torque_noise: Each = ()
    """White noise of the torques, rms [N m], of all joints or of each; that of the scenario of --noise, or 0.05."""
    fs: Real = None
    """Sampling frequency of controller and log [Hz]; that of the scenario of --noise, or 100."""
    limits: File = None
    """What the motion must keep (TOML): ranges, velocities, torques, boxes around the robot; by default what its file says."""
    velocity: Each = ()
    """Largest speed [rad/s, of slides m/s], of all joints or of each; before that of --limits and of the file. MJCF has no word
    for it."""
    acceleration: Each = ()
    """Largest acceleration [rad/s^2, of slides m/s^2], of all joints or of each."""
    weigh: Weights = ()
    """Parameters that count more, as LMY2=4, or less, in the mean of ln sigma."""
    criterion: str = "sigma"
    """sigma: the mean of ln sigma, begun with the determinant; determinant: that alone; to compare with others: condition,
    birdy, smallest."""
    until: Percent = None
    """On the simulated robot: design, run and identify motions one after the other, until one sigma of every parameter makes
    less than so much of a brisk motion's torque, such as 0.1%."""
    seed: int = 0
    """Of random motions and of the search; the same seed gives the same motion."""
    out: Folder = field(default=None, kw_only=True)
    """Folder for motion.csv, scenario.toml, summary.json, report.html and recording.rrd; runs/excited-<robot> by default."""
    parameters: Asked = Parameters()  # noqa: RUF009  # frozen
    """Which parameters are asked for."""
