"""Logs as the command line names them."""

import json
import shlex
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
import tyro

from experiments.errors import ExperimentError
from experiments.identified import Identified
from identify import LogError, MotionLog, TimeError, TorqueChannel
from identify.log_file import read_columns

Meaning = Literal["held", "instantaneous", "averaged"]
Delay = Annotated[str | None, tyro.conf.arg(metavar="SECONDS|estimate")]
Held = Annotated[Meaning | None, tyro.conf.arg(metavar="held|instantaneous|averaged")]


def file_of(log: Path) -> Path:
    """Return the log of a results folder, or the log itself."""
    if not log.is_dir():
        return log
    if not (log / "log.parquet").is_file():
        raise ExperimentError(f"there is no log.parquet in {log}: name a log, or the folder of a run")
    return log / "log.parquet"


def told_by(log: Path) -> dict[str, Any]:
    """Return what the summary of a results folder says of its run: robot, parameters, truth; nothing of a file."""
    path = log / "summary.json"
    if not path.is_file():
        return {}
    try:
        said = json.loads(path.read_text())
        names, values = said["parameters"], said["truth"]
        known = None if values is None else dict(zip(names, map(float, values), strict=True))
        return {"robot": str(said.get("robot") or said["scenario"]["robot"]), "truth": known}
    except (ValueError, KeyError, TypeError, OSError) as error:
        raise ExperimentError(f"{path} is no summary of a run ({error}): name the log itself, {log / 'log.parquet'}") from error


def read(path: Path, torque: Meaning | None, delay: str | None, named: Identified) -> tuple[MotionLog, str]:
    """Return the log, its torque read as the options say, and what is to be said of its delay."""
    columns = read_columns(path)
    try:
        columns = columns.ordered(named.subject.robot.joints)
    except LogError as error:
        raise ExperimentError(f"{path}: {error}; name the robot of the log with --robot") from error
    meaning = torque or (columns.torque.meaning if columns.torque else None)
    if meaning is None:
        raise ExperimentError(
            f"{path} does not say what its torque means: add --torque held (a controller's command), instantaneous (a "
            "measurement) or averaged, and --torque-delay SECONDS or estimate"
        )
    channel = channel_of(columns.torque, meaning, delay)
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

    found = estimate_delay(log, named.basis, named.processing)
    told = MotionLog(log.fs, log.q, log.tau, replace(channel, delay=found.delay))
    sure = f"{1e3 * found.delay:.4g} ms, sigma {1e3 * found.sigma:.2g} ms (not in the sigmas above)"
    return told, f"torque delay estimated from the log: {sure}"


def channel_of(said: TorqueChannel | None, meaning: Meaning, delay: str | None) -> TorqueChannel:
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
