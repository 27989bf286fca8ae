"""Commands that work on logs."""

import json
import re
import shlex
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import numpy as np
import tyro
from rich.console import Console

from experiments.app import app
from experiments.audience import Audience, Watched, Watching
from experiments.errors import ExperimentError
from experiments.interruption import importing
from experiments.page import new_page, show, shown
from experiments.results import results_folder, tell_of, write_recording, write_summary
from identify import MODELS, Basis, Chain, MotionLog, TimeError, TorqueChannel
from identify.log_file import read_columns, read_log, write_log

if TYPE_CHECKING:
    from experiments.identified import Identified

Meaning = Literal["held", "instantaneous", "averaged"]
File = Annotated[Path | None, tyro.conf.arg(metavar="FILE")]
Delay = Annotated[str | None, tyro.conf.arg(metavar="SECONDS|estimate")]
Held = Annotated[Meaning | None, tyro.conf.arg(metavar="held|instantaneous|averaged")]


@app.command(name="identify")
def identify(  # noqa: PLR0913, PLR0917  # the options of a command
    log: tyro.conf.Positional[Path],
    robot: str = "scara",
    torque: Held = None,
    torque_delay: Delay = None,
    chain: str = "idbench",
    model: str = "all",
    estimator: str = "WLS",
    out: File = None,
    label: str = "",
    watching: Watched = Watching(),  # noqa: B008  # frozen
) -> None:
    """Identify a log: CSV or Parquet with the columns t, q1, q2, ..., tau1, tau2, ... in SI units.

    Args:
        log: The file; its times uniform to 1 %. Or the folder of a run, whose recording gets a layer of this identification.
        robot: Name of the robot.
        torque: What a torque sample means: held from its sample on for a period (a controller's command), the torque at an
            instant (a measurement), or the mean over a period. Asked for unless the file says it.
        torque_delay: From a sample to the instant it speaks for, in seconds, or `estimate` to find it from the log.
        chain: Signal processing.
        model: all, explicit, implicit or power.
        estimator: OLS, WLS, ...
        out: Folder for summary.json, recording.rrd and log.parquet.
        label: What to call this identification in a recording; by default chain and estimator. One of that name is replaced.
        watching: How it is watched.
    """
    with importing():
        from experiments.identified import Identified
        from experiments.tables import print_identified

    page, models = new_page(), tuple(MODELS) if model == "all" else (model,)
    if label and (not re.fullmatch(r"[A-Za-z0-9][\w.-]*", label) or label == "inner"):
        raise ExperimentError(f"--label {label!r} must be of letters, digits, dots, hyphens and underscores, and not 'inner'")
    named = Identified((), robot, models=models, chain=chain, estimator=estimator, name=label)  # complains of names first
    known, said = _read(_file(log), torque, torque_delay, named.basis, named.processing)
    found = replace(named, logs=(known,), truth=_truth(log, named))
    with watching.audience() as audience, shown(page):
        print_identified(page, found, str(log))
        if said:
            page.print(said)
        if out is not None:
            _write_results(page, out, log.name, found, watching, audience)
        elif log.is_dir() and watching.rerun:
            from experiments.recording.identified import add_layer

            with results_folder(log) as folder:
                lost = write_recording(folder, add_layer(log, found, audience))
            tell_of(lost, log)
            page.print(f"added to the recording in {log}{watching.hint(log)}", soft_wrap=True)
        elif audience:
            from experiments.recording.identified import record_log

            for _, stream in record_log(found, audience):
                stream.close()


def _write_results(
    page: Console, out: Path, name: str, found: "Identified", watching: Watching, audience: Audience | None
) -> None:
    lost = ""
    with results_folder(out) as folder:
        write_log(found.logs[0], folder / "log.parquet")
        write_summary(folder / "summary.json", {"experiment": "identify", "log": name, **found.summary()})
        if watching.rerun:
            from experiments.recording.identified import record_log

            lost = write_recording(folder, record_log(found, audience))
    tell_of(lost, out)
    page.print(f"written to {out}{watching.hint(out)}", soft_wrap=True)


def _file(log: Path) -> Path:
    """Return the log of a results folder, or the log itself."""
    if not log.is_dir():
        return log
    if not (log / "log.parquet").is_file():
        raise ExperimentError(f"there is no log.parquet in {log}: name a log, or the folder of a run")
    return log / "log.parquet"


def _truth(log: Path, named: "Identified") -> dict[str, float] | None:
    """Return the true parameters that the summary of a results folder states, None without one."""
    path = log / "summary.json"
    if not path.is_file():
        return None
    try:
        said = json.loads(path.read_text())
        names, values = said["parameters"], said["truth"]
        known = None if values is None else dict(zip(names, map(float, values), strict=True))
    except (ValueError, KeyError, TypeError, OSError) as error:
        raise ExperimentError(f"{path} is no summary of a run ({error}): name the log itself, {log / 'log.parquet'}") from error
    return known if tuple(names) == named.basis.parameters else None


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
    channel = _channel(columns.torque, meaning, torque_delay)
    made, widest = at(columns.t, columns.q, columns.tau, channel, fs), float(np.diff(columns.t).max())
    _write(made, out)
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
        delay = f"--torque-delay {log.torque.delay:g}"
        page.print(
            f"written to {target}; uv run idbench identify {target} --torque {log.torque.meaning} {delay}", soft_wrap=True
        )
    show(page)


def _write(log: MotionLog, path: Path) -> None:
    try:
        with results_folder(path.parent) as folder:
            write_log(log, folder / path.name)
    except ValueError as error:
        raise ExperimentError(f"cannot write {path}: {error}") from error


def _read(path: Path, torque: Meaning | None, delay: str | None, basis: Basis, chain: Chain) -> tuple[MotionLog, str]:
    """Return the log, its torque read as the options say, and what is to be said of its delay."""
    columns = read_columns(path)
    meaning = torque or (columns.torque.meaning if columns.torque else None)
    if meaning is None:
        raise ExperimentError(
            f"{path} does not say what its torque means: add --torque held (a controller's command), instantaneous (a "
            "measurement) or averaged, and --torque-delay SECONDS or estimate"
        )
    channel = _channel(columns.torque, meaning, delay)
    try:
        log = MotionLog.at_times(columns.t, columns.q, columns.tau, channel)
    except TimeError as error:
        fs = 1 / float(np.median(np.diff(columns.t)))
        late = f" --torque-delay {channel.delay:g}" if channel.delay else ""
        raise ExperimentError(
            f"{path}: {error}: uv run idbench resample {shlex.quote(str(path))} --fs {fs:.4g} --torque {meaning}{late} "
            "--out uniform.parquet"
        ) from error
    if delay != "estimate":
        assumed = delay is None and columns.torque is None
        return log, "no --torque-delay was given, 0 is assumed: `estimate` finds it" if assumed else ""
    from identify.delay import estimate_delay

    found = estimate_delay(log, basis, chain)
    told = MotionLog(log.fs, log.q, log.tau, replace(channel, delay=found.delay))
    sure = f"{1e3 * found.delay:.4g} ms, sigma {1e3 * found.sigma:.2g} ms (not in the sigmas above)"
    return told, f"torque delay estimated from the log: {sure}"


def _channel(said: TorqueChannel | None, meaning: Meaning, delay: str | None) -> TorqueChannel:
    """Return the channel that a file and the options state together: another meaning voids the delay that the file states."""
    stated = said or TorqueChannel(meaning)
    return replace(stated, meaning=meaning, delay=_seconds(delay, stated.delay if stated.meaning == meaning else 0.0))


def _seconds(delay: str | None, otherwise: float) -> float:
    if delay is None or delay == "estimate":
        return otherwise
    try:
        return float(delay)
    except ValueError:
        raise ExperimentError(f"--torque-delay {delay} must be seconds, such as 0.002, or estimate") from None
