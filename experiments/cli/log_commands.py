"""Commands that change the form of logs."""

import shlex
from pathlib import Path

import numpy as np

from experiments.cli.logs import Export, Resample
from experiments.cli.page import new_page, show
from experiments.cli.reading import channel_of, stated_by
from experiments.errors import ExperimentError, ResultsError
from experiments.identification.results import beside
from experiments.identification.subject import CLOSED_FORM
from identify import MotionLog
from identify.data.log_file import read_columns, read_log, write_log
from identify.data.resample import resample as at


def resample(asked: Resample) -> None:
    """Write a log anew at a fixed sampling frequency."""
    columns, page = read_columns(asked.log), new_page()
    if asked.out.exists() and asked.out.samefile(asked.log):
        raise ExperimentError(f"--out {asked.out} is the log that is read: choose another name")
    if asked.out.exists() and not asked.force:
        raise ExperimentError(f"{asked.out} exists: choose another --out, or replace it with --force")
    meaning = asked.torque or (columns.torque.meaning if columns.torque else None)
    if meaning is None:
        raise ExperimentError(f"{asked.log} does not say what its torque means: add --torque held, instantaneous or averaged")
    channel = channel_of(columns.torque, meaning, asked.torque_delay)
    made, widest = at(columns.t, columns.q, columns.tau, channel, asked.fs), float(np.diff(columns.t).max())
    _write(made, asked.out, columns.joints)
    page.print(f"written to {asked.out}: torque {made.torque.meaning}, delay {made.torque.delay:g} s", soft_wrap=True)
    if widest > 2 / asked.fs:
        page.print(f"warning: a gap of {widest:.3g} s was filled in, with positions and torques that nobody measured")
    show(page)


def export(asked: Export) -> None:
    """Write the logs of a results folder as CSV."""
    logs, page = sorted(asked.folder.glob("log*.parquet")), new_page()
    if not logs:
        raise ExperimentError(f"there is no log in {asked.folder}: name a results folder, such as runs/table1")
    for path in logs:
        log, target = read_log(path), (asked.out or asked.folder) / f"{path.stem}.csv"
        _write(log, target, force=asked.force)
        options = f"--torque {log.torque.meaning} --torque-delay {log.torque.delay:g}{_robot_of(asked.folder)}"
        page.print(f"written to {target}; uv run idbench identify {target} {options}", soft_wrap=True)
    show(page)


def _robot_of(folder: Path) -> str:
    """Return the option that names the robot of a results folder, where it is not the one by default."""
    robot = stated_by(folder).get("robot", CLOSED_FORM)
    return "" if robot == CLOSED_FORM else f" --robot {shlex.quote(robot)}"


def _write(log: MotionLog, path: Path, joints: tuple[str, ...] = (), force: bool = True) -> None:
    try:
        with beside(path.parent) as folder:
            write_log(log, folder / path.name, joints)
            if not force and path.is_file() and path.read_bytes() != (folder / path.name).read_bytes():
                raise ResultsError(f"{path} exists, with other contents: choose another --out, or replace it with --force")
    except ValueError as error:
        raise ExperimentError(f"cannot write {path}: {error}") from error
