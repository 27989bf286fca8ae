"""What a law of friction gains on motion that the parameters were not fitted to."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from idbench.identify.arrays import Array
from idbench.identify.judge.held_out import FOLDS, TINY, HeldOutProducts, sigma_squares, solved, squares

EXCUSED = 2.0
"""Squares at speeds above those of a fit that sigma makes, in multiples of what it makes on average, are no fault of a law."""


@dataclass(frozen=True)
class LawScore:
    """What a law changes on motion that was not fitted."""

    joint: int
    """From 0."""
    law: str
    """Its name."""
    share: float
    """Of the joint's squared error, how much it takes; negative if it adds to it."""
    deviations: float
    """What it takes of the logarithm of the squared errors of the stretches, on average, in standard deviations of that."""
    sigmas: float
    """How many sigma its parameter is away from zero, with independent rows."""
    least: float
    """Share that it takes without the stretch in which it takes most."""
    beyond: float
    """Share that it takes of the squared error at speeds above those of a fit; NaN where that is not asked, as `sigmas`."""
    taken: bool
    """Whether the joint has it in the end."""


def gain(before: Array, after: Array) -> tuple[float, float, float]:
    """Return the share of squared errors that is taken, how many deviations that is from none, and `LawScore.least`."""
    ratio = np.log(np.maximum(before, TINY) / np.maximum(after, TINY))
    spread = float(np.std(ratio, ddof=1) / np.sqrt(FOLDS))
    others = np.delete(np.arange(FOLDS), np.argmax(before - after))
    share, least = (float(1 - after[k].sum() / max(before[k].sum(), TINY)) for k in (np.arange(FOLDS), others))
    return share, float(ratio.mean() / spread) if spread > 0 else 0.0, least


@dataclass(frozen=True, eq=False)
class LawSearch:
    """Laws that are compared beside those of a problem, joint by joint."""

    products: HeldOutProducts
    """Of the rows, stretch by stretch."""

    @property
    def places(self) -> list[tuple[int, str]]:
        """Joints and laws that are compared."""
        return [(j, name) for name, j in self.products.places]

    def score(self, j: int, name: str) -> LawScore:
        """Return what a law gains at a joint."""
        (before, left_open), (after, more_open) = self._errors(j, None), self._errors(j, name)
        if not np.isfinite(after).all():  # nothing that could be solved
            return LawScore(j, name, -np.inf, -np.inf, 0.0, -np.inf, -np.inf, taken=False)
        share, deviations, least = gain(before[:-1], after[:-1])
        # What the noise of the fit makes farther out is no fault of the law.
        beyond = 1 - (after[-1] - EXCUSED * (more_open[-1] - left_open[-1])) / max(before[-1], TINY)
        return LawScore(j, name, share, deviations, self.products.sigmas(name, j), least, float(beyond), taken=False)

    @property
    def errors(self) -> Array:
        """Squared error of each joint on stretches that were not fitted, without further laws, shape (joint,)."""
        return np.array([self.squares(j).sum() for j in range(self.products.start.basis.n)])

    def squares(self, j: int) -> Array:
        """Return squared errors of a joint on stretches that were not fitted, without further laws, shape (FOLDS,)."""
        return self._errors(j, None)[0][:-1]

    def _errors(self, j: int, law: str | None) -> Array:
        """Return squared errors of a joint in every stretch and in the fastest motion, and what sigma makes, (2, FOLDS + 1)."""
        key = law, j
        if key not in self._known:
            self._known[key] = np.array([self._predicted(j, law, k) for k in range(FOLDS + 1)]).T
        return self._known[key]

    @cached_property
    def _known(self) -> dict[tuple[str | None, int], Array]:
        return {}

    def _predicted(self, j: int, law: str | None, fold: int) -> tuple[float, float]:
        """Return the squared error of a joint in a stretch, by a fit of the rest, and what sigma makes of it in fast motion.

        Shapes are those that fit the rest best.
        """
        products = self.products
        judged, fitted = products.held[fold][j], products.fitted(fold, j)
        least = np.inf
        best = np.inf
        spread = 0.0
        # The fastest motion has had no say in the shapes: they are those that fit the slower best.
        every = [[]] if law is None else products.places[law, j] if fold == FOLDS else products.likely(law, j)
        for own in every:
            columns = [*range(products.p), *own]
            X = solved(fitted, columns)
            if (misfit := squares(fitted, columns, X)) < least:
                least, best = misfit, squares(judged, columns, X)
                spread = sigma_squares(fitted, judged, columns) if fold == FOLDS else 0.0
        return best, spread
