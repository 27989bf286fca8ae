"""Commands that change the form of logs."""

import shlex
from pathlib import Path
from typing import Annotated

import numpy as np
import tyro

from experiments.app import app
from experiments.errors import ExperimentError
from experiments.page import new_page, show
from experiments.reading import Delay, Held, channel_of, told_by
from experiments.results import results_folder
from experiments.subject import CLOSED_FORM
from identify import MotionLog
from identify.log_file import read_columns, read_log, write_log

File = Annotated[Path | None, tyro.conf.arg(metavar="FILE")]


@app.command(name="resample")
def resample(log: tyro.conf.Positional[Path], fs: float, out: Path, torque: Held = None, torque_delay: Delay = None) -> None:
    """Write a log anew at a fixed sampling frequency.

    Args:
        log: The file, CSV or Parquet, its times in any steps.
        fs: Sampling frequency [Hz].
        out: File to write, CSV or Parquet.
        torque: What a torque sample means; asked for unless the file says it. A held torque comes out averaged.
        torque_delay: From a sample to the instant it speaks for, in seconds.
    """
    from identify.resample import resample as at

    columns, page = read_columns(log), new_page()
    meaning = torque or (columns.torque.meaning if columns.torque else None)
    if meaning is None:
        raise ExperimentError(f"{log} does not say what its torque means: add --torque held, instantaneous or averaged")
    channel = channel_of(columns.torque, meaning, torque_delay)
    made, widest = at(columns.t, columns.q, columns.tau, channel, fs), float(np.diff(columns.t).max())
    _write(made, out, columns.joints)
    page.print(f"written to {out}: torque {made.torque.meaning}, delay {made.torque.delay:g} s", soft_wrap=True)
    if widest > 2 / fs:
        page.print(f"doubtful: a gap of {widest:.3g} s was filled in, with positions and torques that nobody measured")
    show(page)


@app.command(name="export")
def export(folder: tyro.conf.Positional[Path], out: File = None) -> None:
    """Write the logs of a results folder as CSV.

    Args:
        folder: Results folder, such as runs/table2.
        out: Folder to write to; the results folder itself by default.
    """
    logs, page = sorted(folder.glob("log*.parquet")), new_page()
    if not logs:
        raise ExperimentError(f"there is no log in {folder}: name a results folder, such as runs/table1")
    for path in logs:
        log, target = read_log(path), (out or folder) / f"{path.stem}.csv"
        _write(log, target)
        said = f"--torque {log.torque.meaning} --torque-delay {log.torque.delay:g}{_robot_of(folder)}"
        page.print(f"written to {target}; uv run idbench identify {target} {said}", soft_wrap=True)
    show(page)


def _robot_of(folder: Path) -> str:
    """Return the option that names the robot of a results folder, where it is not the one by default."""
    robot = told_by(folder).get("robot", CLOSED_FORM)
    return "" if robot == CLOSED_FORM else f" --robot {shlex.quote(robot)}"


def _write(log: MotionLog, path: Path, joints: tuple[str, ...] = ()) -> None:
    try:
        with results_folder(path.parent) as folder:
            write_log(log, folder / path.name, joints)
    except ValueError as error:
        raise ExperimentError(f"cannot write {path}: {error}") from error
