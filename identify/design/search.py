"""Descent from several starts, of which the best are followed further."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy

from idbench.identify.arrays import Array
from idbench.identify.design.plan import Plan

MEMORY = 20
"""Steps that L-BFGS remembers."""


class Search:
    """Minimises what plans cost; what was found so far outlives an interruption.

    Parameters
    ----------
    starts : sequence of Array, shape (m, joint)
        Coefficients to begin with.
    steps : int
        How many steps there will be in all, for the progress.
    progress : callable, optional
        Receives how much of the work is done, from 0 to 1.
    """

    def __init__(self, starts: Sequence[Array], steps: int, progress: Callable[[float], None] | None = None) -> None:
        self.found, self.interrupted = list(starts), False
        self._steps, self._done, self._progress = steps, 0, progress

    @property
    def best(self) -> Array:
        """The best coefficients, by the plan that was followed last."""
        return self.found[0]

    def run(self, plan: Plan, keep: int, rounds: int) -> None:
        """Descend from the best of what was found, by L-BFGS; Ctrl-C ends it with what there is.

        Parameters
        ----------
        plan : Plan
            What is asked.
        keep : int
            How many are followed.
        rounds : int
            Most steps from each.
        """
        if self.interrupted:
            return
        ends = [_End(np.inf, start) for start in self.found[:keep]]
        try:
            for end in ends:
                self._descend(plan, end, rounds)
        except KeyboardInterrupt:
            self.interrupted = True
        self.found = [end.c for end in sorted(ends, key=lambda end: end.cost)]

    def _descend(self, plan: Plan, end: "_End", rounds: int) -> None:
        """Descend from an end, which is kept up to date."""
        shape, before, steps = end.c.shape, self._done, 0

        def value(flat: Array) -> tuple[float, Array]:
            cost, slope = plan.value(flat.reshape(shape))
            if cost < end.cost:
                end.cost, end.c = cost, flat.reshape(shape).copy()
            return cost, slope.ravel()

        def step(_: Array) -> None:
            nonlocal steps
            steps += 1
            if self._progress:
                self._progress(min(1.0, (before + steps) / self._steps))

        minimize: Any = scipy.optimize.minimize  # its types know no functions of arrays of one dimension
        options = {"maxiter": rounds, "maxcor": MEMORY}
        minimize(value, end.c.ravel(), jac=True, method="L-BFGS-B", callback=step, options=options)
        self._done = before + rounds


@dataclass
class _End:
    """Where a descent has come to."""

    cost: float
    c: Array
