"""Systems of few rows that stand for many."""

from typing import Any

import numpy as np
import numpy.typing as npt

from identify.system import System

NOISE_STEP = 1.05
"""Rows whose noise differs by less than this factor are weighted alike once they are compressed."""


def compressed(system: System) -> System:
    """Return a system of few rows with the same least-squares solutions, whatever the weights of its groups.

    The rows of each group become their triangular factor; so do, apart, those whose noise differs by more than a step of
    `NOISE_STEP`. Only of a single run.
    """
    noise = np.where(system.valid, system.noise, 1.0)
    step = np.round(np.log(noise) / np.log(NOISE_STEP)).astype(int)
    parts = [
        _factor(system, system.valid & (system.group == group) & (step == level), float(NOISE_STEP**level))
        for group in np.unique(system.group)
        for level in np.unique(step[system.valid & (system.group == group)])
    ] or [_factor(system, system.valid, 1.0)]
    joined: dict[str, Any] = {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
    return System(**joined, parameters=system.parameters)


def _factor(system: System, rows: npt.NDArray[np.bool_], noise: float) -> dict[str, npt.NDArray[Any]]:
    """Return the triangular factor of some rows of one group, as rows."""
    R: npt.NDArray[np.float64] = np.linalg.qr(np.column_stack([system.W[rows], system.Y[rows]]), mode="r")  # type: ignore[assignment]
    stands_for = np.zeros(len(R), dtype=np.intp)
    stands_for[:1] = system.count(rows)
    return {
        "W": R[:, :-1],
        "Y": R[:, -1],
        "noise": np.full(len(R), noise),
        "valid": np.ones(len(R), dtype=bool),
        "time": np.full(len(R), np.mean(system.time)),
        "group": np.full(len(R), system.group[rows][0] if rows.any() else 0),
        "stands_for": stands_for,
    }
