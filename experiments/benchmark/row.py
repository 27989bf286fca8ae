"""One set: its fit, judged on every held-out log, and beside it all that the protocol asks for."""

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict
from functools import partial
from importlib.metadata import version
from itertools import combinations
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from idbench.experiments.benchmark.definition import Definition
from idbench.experiments.benchmark.set_fit import SetFit
from idbench.experiments.benchmark.tools import judged, predictions, what_tools_read, write_for_tools
from idbench.experiments.errors import is_told, reason
from idbench.experiments.exports.exports import EXPORTS
from idbench.experiments.identification.fit import Fit
from idbench.experiments.identification.fitting import fit
from idbench.experiments.identification.logs import Logs
from idbench.experiments.identification.request import Request
from idbench.experiments.judgement.held_out import WORDS, HeldOut
from idbench.experiments.judgement.judgement import Unjudged, judge
from idbench.experiments.requests.jobs import IdentifyRequest
from idbench.experiments.results.writing import finite
from idbench.experiments.text import SIGMAS
from idbench.identify import Estimate, IdentificationError, MotionLog
from idbench.identify.judge.excitation import seen
from idbench.sim.engine.driven import free_run
from idbench.sim.errors import BenchError


class Repeats(NamedTuple):
    """Differences of parameters between fits of single logs, in their standard errors."""

    inside: int
    """How many are within two."""
    compared: int
    """How many there are."""
    failed: tuple[str, ...]
    """Why logs have no fit."""


def repeats(request: Request, logs: Sequence[MotionLog], names: Sequence[str]) -> Repeats:
    """Return how fits of single logs agree, by the first model that each has."""
    fits, failed = list[Estimate](), list[str]()
    for log, name in zip(logs, names, strict=True):
        try:
            found: Fit = fit(request, Logs((log,), (name,), None, (), None))
        except IdentificationError as error:
            failed.append(f"{name}: {error}")
        else:
            fits.append(found.estimates[found.leading])
    # What is grouped with what differs where fits left parameters out.
    pairs = list(combinations(fits, 2))
    alike = [(one, other) for one, other in pairs if one.names == other.names]
    if len(alike) < len(pairs):
        failed.append("fits of single logs that have different parameters are not compared")
    z = [x for one, other in alike for x in _differences(one, other)]
    return Repeats(int(np.sum(np.abs(z) < SIGMAS)), len(z), tuple(failed))


def _differences(one: Estimate, other: Estimate) -> list[float]:
    """Return the differences of the parameters, in standard errors."""
    sigma = np.hypot(one.standard_errors, other.standard_errors)
    z = (one.X - other.X) / np.where(sigma > 0, sigma, np.nan)
    return [float(x) for x in z[np.isfinite(z)]]


def free_runs(held_out: HeldOut, model: str, length: float) -> dict[str, Any]:
    """Return what a summary says of positions that are simulated, from where the log is, for some time.

    NRMSE is the rms of the error over the range of the joint in the log. A simulation that diverges is counted, and has no
    other part in it.
    """
    robot, log, qd = held_out.driven(model)
    measured, simulated = free_run(robot, log, qd, length)
    kept = np.asarray(np.isfinite(simulated).all(axis=(1, 2)))
    squares = (measured[kept] - simulated[kept]) ** 2
    whole = np.ptp(log.q, axis=0)
    nrmse = np.sqrt(squares.mean(axis=(0, 1))) / np.where(whole > 0, whole, np.nan) if kept.any() else np.full(log.n, np.nan)
    return {"length": length, "stretches": len(kept), "diverged": int((~kept).sum()), "nrmse": [finite(x) for x in nrmse]}


UNSHARED = ("", "none stated")  # Licences under which results are not handed on

Made = tuple[dict[str, Any], Callable[[Path], None]]
"""The row of a set, and what writes the files that other tools read into a folder."""


def identified_row(folder: Path, definition: Definition, out: Path) -> Made:
    """Return the row of a set of torques and positions, and what writes the files of other tools into a folder."""
    asked = definition.request(folder)
    assert isinstance(asked, IdentifyRequest)
    made = SetFit.of(folder, definition, asked)
    row = row_of(made, predictions(out))
    return {**row, "tools_read": what_tools_read(made)}, partial(_write, made)


def _write(made: SetFit, folder: Path) -> None:
    """Write what other tools read, and the robot that was identified where the data's licence lets others have it."""
    write_for_tools(made, folder)
    definition, fit = made.definition, made.fit
    if definition.license in UNSHARED:
        return
    said = list[str]()
    for name in ("identified.xml", "identified.json"):
        try:
            exported = EXPORTS[Path(name).suffix].render(fit, fit.leading, folder / name)
        except (BenchError, IdentificationError) as error:  # the row is worth having all the same
            said.append(f"no {name}: {error}")
        else:
            (folder / name).write_text(exported.texts[folder / name], encoding="utf-8")
            said += exported.warnings
    how = f"Identified by {fit.request.estimator} of the {fit.leading} model, idbench {version('idbench')}."
    source = f"Data: {definition.source}; licence: {definition.license}."
    (folder / "SOURCE.md").write_text(f"# {definition.title}\n\n{how}\n\n{chr(10).join([source, *said])}\n", encoding="utf-8")


def row_of(made: SetFit, predicted: Mapping[str, Path]) -> dict[str, Any]:
    """Return the row of a set, with what tools have predicted; a part that fails has its reason in its place."""
    fit, definition = made.fit, made.definition
    judgement, begin = judge(fit), time.perf_counter()
    there = [one for one in judgement.on if isinstance(one, HeldOut)]
    row: dict[str, Any] = {
        "title": definition.title,
        "joints": list(fit.robot_model.robot.joints),
        "model": fit.leading,
        "estimator": fit.request.estimator,
        "parameters": len(fit.basis.names),
        "estimate": _estimate(fit),
        "seconds": made.seconds,
        "logs": _logs(judgement.on, made),
        "published": [asdict(one) for one in definition.published],
        "notes": list(fit.logs.notes),
    }
    row["verdict"] = _worst([log["verdict"] for log in row["logs"] if "verdict" in log])
    row["repeats"] = _attempted(lambda: _repeats(made))
    if definition.free_run:
        row["free_run"] = [_attempted(lambda: free_runs(one, fit.leading, definition.free_run)) for one in there]  # noqa: B023
    row["tools"] = {
        tool: _attempted(lambda: judged(there, path))  # noqa: B023  # called at once
        for tool, path in (predicted if len(there) == len(judgement.on) else {}).items()
    }
    row["seconds_of_judging"] = time.perf_counter() - begin
    return row


def _estimate(fit: Fit) -> dict[str, list[Any]]:
    """Return what the row says of the parameters: estimates, their sigma, and what the robot's file says."""
    found, filed = fit.estimates[fit.leading], fit.robot_model.truth(fit.robot_model.robot)
    return {
        "names": list(fit.basis.names),
        "X": [finite(x) for x in found.X],
        "sigma": [finite(x) for x in np.sqrt(np.diagonal(found.covariance))],
        "filed": [finite(filed[name]) if name in filed else None for name in fit.basis.names],
    }


def _logs(on: Sequence[HeldOut | Unjudged], made: SetFit) -> list[dict[str, Any]]:
    """Return what the row says of each log, with the samples of it that the fit has seen."""
    found, names = [_log(one, made.fit) for one in on], list(made.fit.logs.held_out or {})
    for name, count in made.seen.items():
        for log, own in zip(found, names, strict=False):
            if own == name and "samples_seen" in log:
                log["samples_seen"] = max(log["samples_seen"], count)
    return found


def _log(one: HeldOut | Unjudged, fit: Fit) -> dict[str, Any]:
    if isinstance(one, Unjudged):
        return {"title": one.title, "failure": one.why}
    own, verdict = one.torques[fit.leading], one.verdicts[fit.leading]
    inside, outside = one.within_interval(fit.leading) or (np.full(len(own.rms), np.nan), np.nan)
    return {
        "title": one.title,
        "within_interval": [finite(x) for x in inside],
        "outside_fitted": finite(outside),
        "torque_error_rms": [finite(x) for x in own.rms],
        "torque_error_percent": [finite(x) for x in own.percent],
        "torque_rms": [finite(x) for x in own.level],
        "noise_rms": [finite(x) for x in own.noise],
        "R2": [finite(x) for x in own.R2],
        "verdict": verdict.word,
        "reasons": verdict.reasons,
        "samples": one.log.samples,
        "samples_seen": seen(one.log, fit.logs.fitted),
    }


def _repeats(made: SetFit) -> dict[str, Any]:
    logs = made.repeated
    if len(logs) < 2:
        return {}
    found = repeats(made.fit.request, list(logs.values()), list(logs))
    return {"inside": found.inside, "compared": found.compared, "failed": list(found.failed)}


def _attempted(make: Callable[[], dict[str, Any]]) -> dict[str, Any]:
    """Return a part of a row, or why there is none."""
    try:
        return make()
    except Exception as error:
        if not is_told(error):
            raise
        return {"failure": reason(error)}


def _worst(verdicts: Sequence[str]) -> str | None:
    return max(verdicts, key=WORDS.index, default=None)
