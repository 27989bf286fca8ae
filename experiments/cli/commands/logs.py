"""Commands that change the form of logs."""

import shlex
from collections.abc import Sequence
from contextlib import closing
from dataclasses import replace
from math import log2, log10, pi
from pathlib import Path

from rich.text import Text

from idbench.experiments.cli.options.tools import Export, Resample, ShowLog
from idbench.experiments.errors import ExperimentError
from idbench.experiments.identification.logs import LogFacts
from idbench.experiments.identification.reading import asked_of, channel_of, stated_by
from idbench.experiments.identification.robot_model import SCARA
from idbench.experiments.program import program
from idbench.experiments.results.attempts import Attempts
from idbench.experiments.results.page import Page
from idbench.experiments.results.writing import folder_for, new_file, require_free, write_text
from idbench.experiments.text import new_table, print_titled
from idbench.identify import MotionLog
from idbench.identify.data.log_columns import LogColumns
from idbench.identify.data.resample import Repaired
from idbench.identify.files.guess import UnknownColumnsError
from idbench.identify.files.layout import LAYOUT, LogLayout, Source, own_layout
from idbench.identify.files.log_file import CSV, WRITTEN, read_log, write_log
from idbench.identify.files.reading import Understood, read_columns, understood
from idbench.identify.files.table import needs_gain, read_unit

ROUNDED = 1e-4  # Departure of a step's logarithm from a whole number up to which it is a file's decimal places, no encoder's


def show_log(options: ShowLog) -> None:
    """Show what is understood of a log: columns, units, rate, ranges, noise; write a layout to start from."""
    page = Page(machine=options.json)
    for option, path in (("--write", own_layout(options.log) if options.write else None), ("--picture", options.picture)):
        if path is not None:
            require_free(path, option, force=options.force, read=[options.log])
    found, columns = _understood(options)
    layout, facts = found.files.layout, LogFacts(columns)
    with closing(page):
        _print_layout(page, layout, found.doubts)
        raw = needs_gain(layout.tau.unit) and not layout.gain
        _print_facts(page, facts, read_unit(layout.tau.unit) if raw else "N m")
        for note in (*found.passed_over, *facts.notes()):
            page.print(Text(note), soft_wrap=True)
        page.found |= {**facts.summary(), "layout": layout.text, "doubts": list(found.doubts)}
        page.end()
        with Attempts("the rest is printed") as attempts:
            if options.write:
                attempts.attempt("--write", lambda: _write(page, options, layout))
            if (picture := options.picture) is not None:
                attempts.attempt("--picture", lambda: _draw(page, options, picture, facts))


def _draw(page: Page, options: ShowLog, path: Path, facts: LogFacts) -> None:
    from idbench.experiments.reports.log_picture import figure_of

    with new_file(path, "--picture", force=options.force, read=[options.log]) as file:
        try:
            figure_of(facts).savefig(file, dpi=110)
        except ValueError as error:
            raise ExperimentError(f"--picture {path}: {error}") from error
    page.print(Text(f"picture written to {path}"), soft_wrap=True)


def _understood(options: ShowLog) -> tuple[Understood, LogColumns]:
    """What is understood of a log, and its columns; currents count as torques where their gain is not known yet."""
    path = options.log if options.log.name else options.log.resolve()  # the folder in which one is
    try:
        found = understood(path, asked_of(options.reading), anew=options.force)
    except UnknownColumnsError as error:
        if not options.write:
            raise ExperimentError(f"{error}; --write makes a layout to correct") from error
        write_text(own_layout(options.log), error.start, "--write", force=options.force)
        raise ExperimentError(f"{error}: {own_layout(options.log)} is one to correct") from error
    layout = found.files.layout
    if not layout.t.columns and not layout.t.fs and not layout.samples:
        raise ExperimentError(f"{path}: {'; '.join(found.doubts)}")
    raw = needs_gain(layout.tau.unit) and not layout.gain
    return found, replace(found.files, layout=replace(layout, gain=(1.0,)) if raw else layout).columns


def _print_layout(page: Page, layout: LogLayout, doubts: Sequence[str]) -> None:
    grid = new_table("", ["unit", "columns"])
    for name in ("t", "q", "qd", "qdd", "tau"):
        source: Source = getattr(layout, name)
        if source.columns or source.fs:
            grid.add_row(name, source.unit, ", ".join(source.columns) if source.columns else f"{source.fs:g} Hz")
    print_titled(page, "what its columns are", grid)
    for doubt in doubts:
        page.print(Text(f"look: {doubt}"), soft_wrap=True)


def _print_facts(page: Page, facts: LogFacts, unit: str) -> None:
    heads = ["from [rad]", "to", "qd max", "at rest %", "noise of q", "step", "bits", f"tau [{unit}]", "to", f"noise [{unit}]"]
    grid = new_table("", heads)
    for row in facts.rows:
        step = row["encoder_step"]
        by_file = step is not None and abs(log10(step) - round(log10(step))) < ROUNDED
        bits = "" if step is None else "file" if by_file else f"{log2(2 * pi / step):.1f}"
        grid.add_row(
            row["joint"],
            *(f"{x:.4g}" for x in row["q"]),
            f"{row['qd_max']:.3g}",
            f"{100 * row['standing']:.0f}",
            f"{row['position_noise']:.2g}",
            "" if step is None else f"{step:.3g}",
            bits,
            *(f"{x:.3g}" for x in row["tau"]),
            f"{row['torque_noise']:.2g}",
        )
    t = facts.columns.t
    rate = "" if facts.log.poses else f", {t[-1] - t[0]:.4g} s, {facts.log.fs:.5g} Hz"
    print_titled(page, f"{len(t)} rows{rate}", grid)


def _write(page: Page, options: ShowLog, layout: LogLayout) -> None:
    target = own_layout(options.log)
    write_text(target, layout.text, "--write", force=options.force)
    every = ", and every other log of the folder" if target.name == LAYOUT else ""
    page.print(Text(f"written to {target}: correct it; this log is read by it from now on{every}"), soft_wrap=True)


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
    columns, page = read_columns(options.log, asked_of(options.reading)), Page()
    if columns.qdd is not None:
        raise ExperimentError(f"{options.log} is of samples by themselves, which have no clock to repair")
    meaning = options.torque or (columns.torque.meaning if columns.torque else None)
    if meaning is None:
        raise ExperimentError(f"{options.log} does not say what its torque means: add --torque held, instantaneous or averaged")
    made = Repaired.of(columns, channel_of(columns.torque, meaning, options.torque_delay), options.fs)
    outs = [out] if len(made.logs) == 1 else [out.with_stem(f"{out.stem}{k + 1}") for k in range(len(made.logs))]
    for path in outs:  # all of them, before the first is written
        require_free(path, "--out", force=options.force, read=read)
    with closing(page):
        for words in made.words(columns.names):
            page.print(Text(words), soft_wrap=True)
        for path, log in zip(outs, made.logs, strict=True):
            with new_file(path, "--out", force=options.force, read=read) as file:
                _write_log(log, file, columns.joints)
            torque = f"torque {log.torque.meaning}, delay {log.torque.delay:g} s"
            page.print(Text(f"written to {path}: {log.samples} samples at {log.fs:.6g} Hz, {torque}"), soft_wrap=True)


def export(options: Export) -> None:
    """Write the logs of a results folder as CSV."""
    logs, page = sorted(options.folder.glob("log*.parquet")), Page()
    if not logs:
        raise ExperimentError(f"there is no log in {options.folder}: name a results folder, such as runs/table1")
    made = folder_for(options.out or options.folder, "--out")
    robot = stated_by(options.folder).get("robot", SCARA)
    named = "" if robot == SCARA else f" --robot {shlex.quote(robot)}"
    with closing(page):
        for path in logs:
            log, target = read_log(path), made / f"{path.stem}.csv"
            with new_file(target, "--out", force=options.force) as file:
                _write_log(log, file)
            options_of = f"--torque {log.torque.meaning} --torque-delay {log.torque.delay:g}{named}"
            page.print(f"written to {target}; {program()} identify {target} {options_of}", soft_wrap=True)


def _write_log(log: MotionLog, path: Path, joints: tuple[str, ...] = ()) -> None:
    try:
        write_log(log, path, joints)
    except ValueError as error:
        raise ExperimentError(f"cannot write {path.name}: {error}") from error
