"""Commands that change the form of logs."""

import shlex
from pathlib import Path

from rich.text import Text

from idbench.experiments.cli.options.tools import Export, Resample
from idbench.experiments.errors import ExperimentError
from idbench.experiments.identification.reading import channel_of, columns_of, stated_by
from idbench.experiments.identification.robot_model import SCARA
from idbench.experiments.results.page import new_page, shown
from idbench.experiments.results.writing import folder_for, new_file, require_free
from idbench.identify import MotionLog
from idbench.identify.data.resample import Repaired
from idbench.identify.files.layout import LAYOUT
from idbench.identify.files.log_file import CSV, WRITTEN, read_log, write_log


def resample(options: Resample) -> None:
    """Write a log anew at a fixed sampling frequency, its clock repaired."""
    out, read = options.out, (options.log,)
    if options.fs is not None and not 0 < options.fs < float("inf"):
        raise ExperimentError(f"--fs {options.fs:g} must be a number above 0 [Hz]; leave it out for that of the log")
    if out.suffix.lower() not in WRITTEN:
        raise ExperimentError(f"--out {out}: its name must end with {' or '.join(WRITTEN)}")
    if out.suffix.lower() == CSV and (out.parent / LAYOUT).is_file():
        raise ExperimentError(f"--out {out}: {LAYOUT} there would be taken for its columns: choose another folder, or .parquet")
    require_free(out, "--out", force=options.force, read=read)
    columns, page = columns_of(options.log, options.reading), new_page()
    meaning = options.torque or (columns.torque.meaning if columns.torque else None)
    if meaning is None:
        raise ExperimentError(f"{options.log} does not say what its torque means: add --torque held, instantaneous or averaged")
    made = Repaired.of(columns, channel_of(columns.torque, meaning, options.torque_delay), options.fs)
    several = len(made.logs) > 1
    outs = [out.with_stem(f"{out.stem}{k + 1}") if several else out for k in range(len(made.logs))]
    for path in outs:  # all of them, before the first is written
        require_free(path, "--out", force=options.force, read=read)
    with shown(page):
        for words in made.words(columns.joints or tuple(f"joint {j + 1}" for j in range(columns.n))):
            page.print(Text(words), soft_wrap=True)
        for path, log in zip(outs, made.logs, strict=True):
            with new_file(path, "--out", force=options.force, read=read) as file:
                _write(log, file, columns.joints)
            torque = f"torque {log.torque.meaning}, delay {log.torque.delay:g} s"
            page.print(Text(f"written to {path}: {log.samples} samples at {log.fs:.6g} Hz, {torque}"), soft_wrap=True)


def export(options: Export) -> None:
    """Write the logs of a results folder as CSV."""
    logs, page = sorted(options.folder.glob("log*.parquet")), new_page()
    if not logs:
        raise ExperimentError(f"there is no log in {options.folder}: name a results folder, such as runs/table1")
    out = options.out or options.folder
    made = folder_for(out, "--out")
    with shown(page):
        for path in logs:
            log, target = read_log(path), made / f"{path.stem}.csv"
            with new_file(target, "--out", force=options.force) as file:
                _write(log, file)
            options_of = f"--torque {log.torque.meaning} --torque-delay {log.torque.delay:g}{_robot_of(options.folder)}"
            page.print(f"written to {target}; uv run idbench identify {target} {options_of}", soft_wrap=True)


def _robot_of(folder: Path) -> str:
    """Return the option that names the robot of a results folder, where it is not the one by default."""
    robot = stated_by(folder).get("robot", SCARA)
    return "" if robot == SCARA else f" --robot {shlex.quote(robot)}"


def _write(log: MotionLog, path: Path, joints: tuple[str, ...] = ()) -> None:
    try:
        write_log(log, path, joints)
    except ValueError as error:
        raise ExperimentError(f"cannot write {path.name}: {error}") from error
