"""Options of the commands about the form of logs."""

from dataclasses import dataclass
from pathlib import Path
from typing import final

import tyro

from experiments.cli.app import command
from experiments.cli.command import Command
from experiments.cli.options.shared import Reading
from experiments.identification.read_options import ColumnOptions
from experiments.option_types import Delay, File, Folder, Hertz, Json, Torque


@command("log")
@final
@dataclass(frozen=True)
class ShowLog(Command, action="log:show_log"):
    """Show what is understood of a log: its columns and units, rate and clock, ranges, noise, encoders. Needs no robot."""

    log: tyro.conf.Positional[Path]
    """The file: CSV and other text, Parquet, NumPy, Matlab, a ROS bag; or its log.toml."""
    reading: Reading = ColumnOptions()  # noqa: RUF009  # frozen
    """What its columns are; guessed from their names and values if nothing says it."""
    write: bool = False
    """Write what was understood as a file beside the log, NAME.toml, to be corrected: what is read later is what it says."""
    picture: File = None
    """Picture to write, PNG or SVG: motion, torques, spectra, time steps."""
    force: bool = False
    """Guess anew although there is such a file, and replace it."""
    json: Json = False
    """Print the same as JSON; what is for people goes to the error stream."""


@command("resample")
@final
@dataclass(frozen=True)
class Resample(Command, action="resample:resample"):
    """Write a log anew at a fixed sampling frequency, its clock repaired: repeated rows, jitter, drops, gaps."""

    log: tyro.conf.Positional[Path]
    """The file, its times in any steps."""
    out: Path
    """File to write, CSV or Parquet; a log with gaps becomes several, numbered."""
    fs: Hertz = None
    """Sampling frequency [Hz]; by default that of the log."""
    reading: Reading = ColumnOptions()  # noqa: RUF009  # frozen
    """What its columns are."""
    torque: Torque = None
    """What a torque sample means; asked for unless the file says it. A held torque comes out averaged."""
    torque_delay: Delay = None
    """From a sample to the instant it speaks for, in seconds."""
    force: bool = False
    """Replace a file that is there already."""


@command("export")
@final
@dataclass(frozen=True)
class Export(Command, action="resample:export"):
    """Write the logs of a results folder as CSV."""

    folder: tyro.conf.Positional[Path]
    """Results folder, such as runs/table2."""
    out: Folder = None
    """Folder to write to; the results folder itself by default."""
    force: bool = False
    """Replace files with other contents."""
