"""Logs as the command line names them."""

import json
import shlex
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from experiments.cli.options import Meaning
from experiments.errors import ExperimentError
from experiments.identification.identified import Identified
from identify import Array, LogError, MotionLog, TimeError, TorqueChannel
from identify.data.log_file import read_columns

SLOWEST = 0.5
"""Sampling period [s] that no robot's log has: its times are in another unit."""

TURN = 2 * np.pi

NEARLY = 0.2
"""Share of a turn by which a jump may differ from one: the joint moves on between two samples."""


def file_of(log: Path) -> Path:
    """Return the log of a results folder, or the log itself."""
    if not log.is_dir():
        return log
    if not (log / "log.parquet").is_file():
        raise ExperimentError(f"there is no log.parquet in {log}: name a log, or the folder of a run")
    return log / "log.parquet"


def stated_by(log: Path) -> dict[str, Any]:
    """Return what the summary of a results folder says of its run: robot, parameters, truth; nothing of a file."""
    path = log / "summary.json"
    if not path.is_file():
        return {}
    try:
        stated = json.loads(path.read_text())
        names, values = stated["parameters"], stated["truth"]
        known = None if values is None else dict(zip(names, map(float, values), strict=True))
        return {"robot": str(stated.get("robot") or stated["scenario"]["robot"]), "truth": known}
    except (ValueError, KeyError, TypeError, OSError, RecursionError) as error:
        raise ExperimentError(f"{path} is no summary of a run ({error}): name the log itself, {log / 'log.parquet'}") from error


@dataclass(frozen=True)
class Question:
    """What is asked of a log beside its columns.

    Parameters
    ----------
    torque, delay : str, optional
        What its torque means, and its delay, as options say.
    unwrap : bool
        Whether jumps of a hinge by a turn are undone.
    otherwise : TorqueChannel, optional
        What its torque means, whatever the file says.
    fallback : TorqueChannel, optional
        What it means where the file says nothing.
    """

    torque: Meaning | None = None
    delay: str | None = None
    unwrap: bool = False
    otherwise: TorqueChannel | None = None
    fallback: TorqueChannel | None = None


def read(path: Path, question: Question, named: Identified) -> tuple[MotionLog, str]:
    """Return the log, its torque read as the options say, and notes on its delay."""
    columns, delay = read_columns(path), question.delay
    try:
        columns = columns.ordered(named.subject.robot.joints)
    except LogError as error:
        raise ExperimentError(f"{path}: {error}; name the robot of the log with --robot") from error
    stated = columns.torque or question.fallback
    meaning = question.torque or (stated.meaning if stated else None)
    if meaning is None:
        raise ExperimentError(
            f"{path} does not say what its torque means: add --torque held (a controller's command), instantaneous (a "
            "measurement) or averaged, and --torque-delay SECONDS or estimate"
        )
    channel = question.otherwise or channel_of(stated, meaning, delay)
    _require_seconds(path, columns.t)
    if not np.any(columns.tau) and np.ptp(columns.q, axis=0).any():
        raise ExperimentError(f"{path}: all torques are 0: there is nothing to identify")
    q = _turned(path, columns.q, named, question.unwrap)
    try:
        log = MotionLog.at_times(columns.t, q, columns.tau, channel)
    except TimeError as error:
        fs = 1 / float(np.median(np.diff(columns.t)))
        late = f" --torque-delay {channel.delay:g}" if channel.delay else ""
        raise ExperimentError(
            f"{path}: {error}: uv run idbench resample {shlex.quote(str(path))} --fs {fs:.4g} --torque {meaning}{late} "
            "--out uniform.parquet"
        ) from error
    if delay != "estimate":
        assumed = delay is None and stated is None
        return log, "no --torque-delay was given, 0 is assumed: `estimate` finds it" if assumed else ""
    from identify.judge.delay import estimate_delay

    found = estimate_delay(log, named.basis, named.processing)
    log = MotionLog(log.fs, log.q, log.tau, replace(channel, delay=found.delay))
    sure = f"{1e3 * found.delay:.4g} ms, sigma {1e3 * found.sigma:.2g} ms (not in the sigmas above)"
    return log, f"torque delay estimated from the log: {sure}"


def _require_seconds(path: Path, t: Array) -> None:
    """Raise ExperimentError if times are those of a log in another unit."""
    step = float(np.median(np.diff(t))) if len(t) > 1 and np.isfinite(t).all() else 0.0
    if step >= SLOWEST:
        raise ExperimentError(
            f"{path} has a sample every {step:.4g} s, if t is in s: is it in ms, microseconds or ns? Divide it by 1e3, 1e6 or "
            "1e9"
        )


def _turned(path: Path, q: Array, named: Identified, unwrap: bool) -> Array:
    """Return positions whose hinges do not jump by a turn, undone if that is wanted; raise ExperimentError if it is not."""
    tree, q = named.subject.tree, q.copy()
    for j, joint in enumerate(tree.joints):
        jumps = np.abs(np.abs(np.diff(q[:, j])) - TURN) < NEARLY * TURN
        if joint.kind != "hinge" or not jumps.any():
            continue
        if not unwrap:
            k = int(np.argmax(jumps))
            raise ExperimentError(
                f"{path}: {joint.name} jumps from {q[k, j]:.4g} to {q[k + 1, j]:.4g} rad at sample {k + 1}: an angle that "
                "starts anew at every turn? Add --unwrap to count the turns"
            )
        q[:, j] = np.unwrap(q[:, j])
    return q


def channel_of(stated: TorqueChannel | None, meaning: Meaning, delay: str | None) -> TorqueChannel:
    """Return the channel that a file and the options state together: another meaning voids the delay that the file states."""
    stated = stated or TorqueChannel(meaning)
    return replace(stated, meaning=meaning, delay=_seconds(delay, stated.delay if stated.meaning == meaning else 0.0))


def _seconds(delay: str | None, otherwise: float) -> float:
    if delay is None or delay == "estimate":
        return otherwise
    try:
        return float(delay)
    except ValueError:
        raise ExperimentError(f"--torque-delay {delay} must be seconds, such as 0.002, or estimate") from None
