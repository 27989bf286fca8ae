"""Logs fitted one by one: do intervals of the same parameter overlap as they should?"""

from collections.abc import Sequence
from itertools import combinations
from typing import NamedTuple

import numpy as np

from experiments.identification.fit import Fit, fit
from experiments.identification.logs import Logs
from experiments.identification.request import Request
from experiments.style import SIGMAS
from identify import Estimate, IdentificationError, MotionLog


class Repeats(NamedTuple):
    """Differences of parameters between fits of single logs, in their standard errors.

    Parameters
    ----------
    inside : int
        How many are within two.
    compared : int
        How many there are.
    failed : tuple of str
        Why logs have no fit.
    """

    inside: int
    compared: int
    failed: tuple[str, ...]

    @property
    def share(self) -> float:
        """Share within two standard errors: 95 % if these are right; NaN if nothing was compared."""
        return self.inside / self.compared if self.compared else float("nan")


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
    z = [x for one, other in combinations(fits, 2) for x in _differences(one, other)]
    return Repeats(int(np.sum(np.abs(z) < SIGMAS)), len(z), tuple(failed))


def _differences(one: Estimate, other: Estimate) -> list[float]:
    """Return the differences of the parameters that both have, in standard errors."""
    values = [dict(zip(e.names, zip(e.X, e.standard_errors, strict=True), strict=True)) for e in (one, other)]
    both = [(values[0][name], values[1][name]) for name in values[0] if name in values[1]]
    z = [(x - y) / np.hypot(sigma, tau) for (x, sigma), (y, tau) in both if sigma > 0 or tau > 0]
    return [float(x) for x in z if np.isfinite(x)]
