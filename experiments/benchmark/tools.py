"""Torques that other tools predict for held-out logs, judged as ours are."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, final
from zipfile import BadZipFile

import numpy as np

from idbench.experiments.benchmark.for_tools import acting, at_times
from idbench.experiments.errors import ExperimentError
from idbench.experiments.identification.held_out import HeldOut
from idbench.experiments.results.summaries import finite
from idbench.identify import Array, Problem, validate

PREDICTED = "predicted-*.npz"
"""Names of the files of other tools, in the folder of a set's results."""


@final
@dataclass(frozen=True)
class Predicted:
    """What a tool has predicted."""

    torques: tuple[Array, ...]
    """Torques at the samples of each held-out log [N m], shape (time, joint)."""
    seconds: float
    """How long its fit took."""
    note: str
    """Its settings, and what else is to be known."""


def predictions(folder: Path) -> dict[str, Path]:
    """Return the files that tools have left in the folder of a set's results, by the names of the tools.

    A file `predicted-TOOL.npz` has `held_out1`, `held_out2`, ..., and `seconds` and `note` if it has them.
    """
    return {path.stem.partition("-")[2]: path for path in sorted(folder.glob(PREDICTED))}


def _read(path: Path, count: int) -> Predicted:
    """Return what a tool has predicted; raise ExperimentError if its file does not have it."""
    try:
        with np.load(path) as file:
            torques = tuple(np.asarray(file[f"held_out{k + 1}"], dtype=float) for k in range(count))
            seconds = float(file["seconds"]) if "seconds" in file else float("nan")
            return Predicted(torques, seconds, str(file["note"]) if "note" in file else "")
    except (OSError, KeyError, ValueError, TypeError, EOFError, BadZipFile) as error:
        names = " and ".join(dict.fromkeys(("held_out1", f"held_out{count}")))
        raise ExperimentError(f"{path.name} must have {names}, torques of each log: {error}") from error


def judged(held_out: Sequence[HeldOut], path: Path) -> dict[str, Any]:
    """Return what a summary says of a tool: the residual torque of each log, on the rows on which ours is judged.

    Raises
    ------
    ExperimentError
        If its file is none.
    """
    predicted = _read(path, len(held_out))
    return {
        "seconds": finite(predicted.seconds),
        "note": predicted.note,
        "logs": [_judged(one, tau) for one, tau in zip(held_out, predicted.torques, strict=True)],
    }


def _judged(held_out: HeldOut, tau: Array) -> dict[str, Any]:
    log = held_out.log
    if tau.shape != log.tau.shape:
        return {"failure": f"torques of the shape {tau.shape}, of a log of {log.tau.shape}"}
    if not np.isfinite(tau).all():
        return {"failure": f"{np.count_nonzero(~np.isfinite(tau))} torques are not finite"}
    as_logged = at_times(log.t + acting(log.torque, log.fs), log.t, tau)
    left = replace(log, tau=log.tau * np.asarray(log.torque.gain) - as_logged, torque=replace(log.torque, gain=1.0))
    plain = held_out.fit.robot_model.plain.basis
    problem = Problem((left,), plain, held_out.fit.problem.model, held_out.fit.processing)
    validation = validate(problem, np.zeros(len(plain.names)))
    own = next(iter(held_out.torques.values()))
    R2 = 1 - (1 - own.R2) * (validation.rms / own.rms) ** 2
    return {"torque_error_rms": [finite(x) for x in validation.rms], "R2": [finite(x) for x in R2]}
