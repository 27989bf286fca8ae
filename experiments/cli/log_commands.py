"""Commands that change the form of logs."""

import shlex
from pathlib import Path

from rich.text import Text

from experiments.cli.logs import Export, Resample
from experiments.cli.page import new_page, show
from experiments.cli.reading import channel_of, columns_of, stated_by
from experiments.errors import ExperimentError, ResultsError
from experiments.identification.results import beside
from experiments.identification.subject import CLOSED_FORM
from identify import MotionLog
from identify.data.resample import Repaired
from identify.files.layout import LAYOUT
from identify.files.log_file import CSV, read_log, write_log


def resample(asked: Resample) -> None:
    """Write a log anew at a fixed sampling frequency, its clock repaired."""
    columns, page = columns_of(asked.log, asked.reading), new_page()
    if asked.out.exists() and asked.out.samefile(asked.log):
        raise ExperimentError(f"--out {asked.out} is the log that is read: choose another name")
    if asked.out.exists() and not asked.force:
        raise ExperimentError(f"{asked.out} exists: choose another --out, or replace it with --force")
    if asked.out.suffix.lower() == CSV and (asked.out.parent / LAYOUT).is_file():
        raise ExperimentError(
            f"--out {asked.out}: {LAYOUT} there would be taken for its columns: choose another folder, or .parquet"
        )
    meaning = asked.torque or (columns.torque.meaning if columns.torque else None)
    if meaning is None:
        raise ExperimentError(f"{asked.log} does not say what its torque means: add --torque held, instantaneous or averaged")
    channel = channel_of(columns.torque, meaning, asked.torque_delay)
    made = Repaired.of(columns, channel, asked.fs)
    for words in made.words(columns.joints or tuple(f"joint {j + 1}" for j in range(columns.n))):
        page.print(Text(words), soft_wrap=True)
    for k, log in enumerate(made.logs):
        out = asked.out if len(made.logs) == 1 else asked.out.with_stem(f"{asked.out.stem}{k + 1}")
        _write(log, out, columns.joints)
        torque = f"torque {log.torque.meaning}, delay {log.torque.delay:g} s"
        page.print(Text(f"written to {out}: {log.samples} samples at {log.fs:.6g} Hz, {torque}"), soft_wrap=True)
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
