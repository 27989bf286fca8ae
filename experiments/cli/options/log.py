"""Options of the commands about the form of logs."""

from dataclasses import dataclass
from pathlib import Path
from typing import final

import tyro

from idbench.experiments.cli.app import command
from idbench.experiments.cli.command import Command
from idbench.experiments.cli.options.shared import Reading
from idbench.experiments.identification.read_options import ColumnOptions
from idbench.experiments.option_types import Delay, File, Folder, Hertz, Json, Torque


@command("log")
@final
@dataclass(frozen=True)
class ShowLog(Command, action="log:show_log"):
    """Show the contents of a log: columns, units, rate, clock, ranges, noise, encoders. Needs no robot."""

    log: tyro.conf.Positional[Path]
    """The file: CSV and other text, Parquet, NumPy, Matlab, a ROS bag; or its log.toml."""
    reading: Reading = ColumnOptions()  # noqa: RUF009  # frozen
    """What the columns are; guessed from names and values if not stated."""
    write: bool = False
    """Write this description to NAME.toml beside the log, to be corrected. Other commands read the log as it states."""
    picture: File = None
    """Write a picture (PNG or SVG): motion, torques, spectra, time steps."""
    force: bool = False
    """Guess again and replace an existing description."""
    json: Json = False
    """Print as JSON; human-readable text goes to the error stream."""


@command("resample")
@final
@dataclass(frozen=True)
class Resample(Command, action="resample:resample"):
    """Resample a log at a fixed frequency and repair its clock: repeated rows, jitter, missing samples, gaps."""

    log: tyro.conf.Positional[Path]
    """The log, with arbitrary time steps."""
    out: Path
    """File to write, CSV or Parquet. A log with gaps becomes several numbered files."""
    fs: Hertz = None
    """Sampling frequency [Hz]. Default: that of the log."""
    reading: Reading = ColumnOptions()  # noqa: RUF009  # frozen
    """What the columns are."""
    torque: Torque = None
    """What a torque sample means. Required unless the file states it. A held torque becomes averaged."""
    torque_delay: Delay = None
    """Delay from a sample to the torque that it stands for, in seconds."""
    force: bool = False
    """Replace an existing file."""


@command("export")
@final
@dataclass(frozen=True)
class Export(Command, action="resample:export"):
    """Write the logs of a results folder as CSV."""

    folder: tyro.conf.Positional[Path]
    """Results folder, such as runs/table2."""
    out: Folder = None
    """Folder to write to. Default: the results folder."""
    force: bool = False
    """Replace existing files."""
