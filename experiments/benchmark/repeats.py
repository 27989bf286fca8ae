"""Logs fitted one by one: do intervals of the same parameter overlap as they should?"""

from collections.abc import Sequence
from itertools import combinations
from typing import NamedTuple

import numpy as np

from idbench.experiments.identification.fit import Fit, fit
from idbench.experiments.identification.logs import Logs
from idbench.experiments.identification.request import Request
from idbench.experiments.style import SIGMAS
from idbench.identify import Estimate, IdentificationError, MotionLog


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
