"""Products of the columns of laws of friction, stretch by stretch of the logs: what fits and predictions need, made once.

Laws are compared by them, joint by joint, on motion that was not fitted.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise, product

import numpy as np

from idbench.identify.arrays import TINY, Array
from idbench.identify.basis.block import AbstractBlock
from idbench.identify.basis.friction.shape import ShapedFriction
from idbench.identify.basis.joint_law import AbstractFriction
from idbench.identify.basis.of_joints import OfJoints
from idbench.identify.estimators.leave_out import NOTHING, RIDGE
from idbench.identify.estimators.leave_out import solved as solution
from idbench.identify.estimators.problem import Problem
from idbench.identify.estimators.settle import Candidates
from idbench.identify.rows.factors import Status

GRID = 32  # Values of each unknown shape of a law that are compared
LOOKED = 4  # Of these, those that explain all rows best are compared on rows that are left out
FOLDS = 10  # Stretches of the logs, each of which is predicted by a fit of the others

FAST = 0.8
"""Speeds of a joint above this share of the rows are predicted once more, by a fit of the slower ones: a law that holds within
the speeds of a fit alone fails there."""

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
class HeldOutProducts:
    """Products of columns with each other, P of them with those of all laws at all their starting shapes, and with Y."""

    start: Problem
    """That of the laws that all joints have."""
    held: Array
    """Held-out data of every joint: stretch by stretch, and its fastest motion, shape (FOLDS + 1, joint, P + 1, P + 1)."""
    weight: Array
    """1 over the variance of the joint's error without the laws, shape (joint,)."""
    p: int
    """Number of parameters that all joints have."""
    places: Mapping[tuple[str, int], list[list[int]]]
    """Which columns a law of a joint has, one list for every combination of its shapes."""

    @classmethod
    def of(cls, start: Problem, candidates: Mapping[str, AbstractBlock]) -> "HeldOutProducts":
        """Return the products of a problem's rows, and of those that candidates for further laws have."""
        X = start.factors.fit(2).X
        basis = start.basis
        places = dict[tuple[str, int], list[list[int]]]()
        for law, block in candidates.items():
            there = {parameter.joint for parameter in block.parameters(basis.n) if parameter in basis.places}
            shaped, first = _at_all_shapes(block), len(basis.names)
            made = OfJoints(shaped.adapted(start.basis, X), tuple(j for j in range(basis.n) if j not in there))
            basis = basis + made
            for j in made.joints:
                own = [first + i for i, parameter in enumerate(made.parameters(basis.n)) if parameter.joint == j]
                if own:  # a law may be one of some joints
                    places[law, j] = [[i] for i in own] if isinstance(shaped, Candidates) else [own]
        basis = basis + _Speed()
        rows = start.with_basis(basis).rows
        joined = np.swapaxes(rows.joined.reshape(-1, rows.kinds, len(basis.names) + 1), 0, 1)
        first = len(basis.names) - basis.n
        speed = np.abs(np.array([joined[j, :, first + j] for j in range(basis.n)]))
        held = _held(np.concatenate([joined[..., :first], joined[..., -1:]], axis=-1), speed)
        weight = start.factors.rows / np.maximum(start.factors.squares(X), TINY)
        return cls(start, held, weight, len(start.names), places)

    def in_sigmas(self, letters: str, j: int) -> float:
        """Return the estimate of a parameter of a joint without further laws, in sigma of independent rows, shapes free."""
        place = next(k for p, k in self.start.basis.places.items() if (p.symbol, p.joint) == (letters, j))
        fit = self.start.factors.fit(2)
        return float(fit.X[place] / np.sqrt(fit.factor.inverse(fit.factor.status == Status.OK)[place, place]))

    def sigmas(self, law: str, j: int) -> float:
        """Distance of a law's parameters from zero [sigma], at the shapes that explain most."""
        columns = [*range(self.p), *self.likely(law, j)[0]]
        X, C = solved(self._every, columns), _inverse(self._every, columns)
        return float((np.abs(X[self.p :]) / np.sqrt(np.maximum(np.diagonal(C)[self.p :], TINY))).max())

    def likely(self, law: str, j: int) -> list[list[int]]:
        """Return the columns of a law at the shapes that explain all rows best, the best first."""
        if (law, j) not in self._likely:
            every = ([*range(self.p), *own] for own in self.places[law, j])
            misfits = [squares(self._every, columns, solved(self._every, columns)) for columns in every]
            order = np.argsort(misfits, kind="stable")[:LOOKED]
            self._likely[law, j] = [self.places[law, j][int(i)] for i in order]
        return self._likely[law, j]

    @cached_property
    def _likely(self) -> dict[tuple[str, int], list[list[int]]]:
        return {}

    @cached_property
    def _every(self) -> Array:
        """The products of all rows, weighted, shape (P + 1, P + 1)."""
        return np.einsum("k,kab->ab", self.weight, self.held[:FOLDS].sum(axis=0))

    def fitted(self, fold: int, j: int) -> Array:
        """Return the products of all rows but those that are left out, weighted, shape (P + 1, P + 1)."""
        key = fold, j if fold == FOLDS else -1
        if key not in self._known:
            left = self.weight * np.where(np.arange(len(self.weight)) == j, 1.0, 0.0 if fold == FOLDS else 1.0)
            self._known[key] = self._every - np.einsum("k,kab->ab", left, self.held[fold])
        return self._known[key]

    @cached_property
    def _known(self) -> dict[tuple[int, int], Array]:
        return {}

    def score(self, j: int, name: str) -> LawScore:
        """Gain of a law at a joint."""
        (before, left_open), (after, more_open) = self._errors(j, None), self._errors(j, name)
        if not np.isfinite(after).all():  # nothing that could be solved
            return LawScore(j, name, -np.inf, -np.inf, 0.0, -np.inf, -np.inf, taken=False)
        share, deviations, least = gain(before[:-1], after[:-1])
        # What the noise of the fit makes farther out is no fault of the law.
        beyond = 1 - (after[-1] - EXCUSED * (more_open[-1] - left_open[-1])) / max(before[-1], TINY)
        return LawScore(j, name, share, deviations, self.sigmas(name, j), least, float(beyond), taken=False)

    @property
    def errors(self) -> Array:
        """Squared error of each joint on stretches that were not fitted, without further laws, shape (joint,)."""
        return np.array([self.squares(j).sum() for j in range(self.start.basis.n)])

    def squares(self, j: int) -> Array:
        """Return squared errors of a joint on stretches that were not fitted, without further laws, shape (FOLDS,)."""
        return self._errors(j, None)[0][:-1]

    def _errors(self, j: int, law: str | None) -> Array:
        """Return squared errors of a joint in every stretch and in the fastest motion, and what sigma makes, (2, FOLDS + 1)."""
        key = law, j
        if key not in self._found:
            self._found[key] = np.array([self._predicted(j, law, k) for k in range(FOLDS + 1)]).T
        return self._found[key]

    @cached_property
    def _found(self) -> dict[tuple[str | None, int], Array]:
        return {}

    def _predicted(self, j: int, law: str | None, fold: int) -> tuple[float, float]:
        """Return the squared error of a joint in a stretch, by a fit of the rest, and what sigma makes of it in fast motion.

        Shapes are those that fit the rest best.
        """
        judged, fitted = self.held[fold][j], self.fitted(fold, j)
        least, best, spread = np.inf, np.inf, 0.0
        # The fastest motion has had no say in the shapes: they are those that fit the slower best.
        every = [[]] if law is None else self.places[law, j] if fold == FOLDS else self.likely(law, j)
        for own in every:
            columns = [*range(self.p), *own]
            X = solved(fitted, columns)
            if (misfit := squares(fitted, columns, X)) < least:
                least, best = misfit, squares(judged, columns, X)
                sigma_squares = _inverse(fitted, columns) * judged[np.ix_(columns, columns)] if fold == FOLDS else 0.0
                spread = float(np.sum(sigma_squares))
        return best, spread


class _Speed(AbstractFriction):
    """Velocities of the rows."""

    symbol = "speed of row "
    unit = "rad/s"

    def force(self, q: Array, qd: Array) -> Array:
        return qd


def _at_all_shapes(block: AbstractBlock) -> AbstractBlock:
    """Return a block with a parameter for every combination of starting shapes, in the place of unknown shapes."""
    if not isinstance(block, ShapedFriction):
        return block
    grid = product(*(shape.grid(GRID) for shape in block.shapes))
    return Candidates(block.law, tuple(dict(zip((s.setting for s in block.shapes), at, strict=True)) for at in grid))


def _held(joined: Array, speed: Array) -> Array:
    """Return the products of held-out rows, shape (FOLDS + 1, joint, P + 1, P + 1), of rows (joint, time, P + 1)."""
    ends = np.linspace(0, joined.shape[1], FOLDS + 1).round().astype(int)
    stretches = [joined[:, a:b] for a, b in pairwise(ends)]
    moving = [np.quantile(v[v > 0], FAST) if (v > 0).any() else np.inf for v in speed]
    fast = joined * (speed > np.array(moving)[:, None])[..., None]
    return np.array([np.matmul(np.swapaxes(x, -1, -2), x) for x in (*stretches, fast)])


def solved(products: Array, columns: Sequence[int]) -> Array:
    """Least-squares solution from products of some columns."""
    return solution(products[np.ix_([*columns, -1], [*columns, -1])])


def _inverse(products: Array, columns: Sequence[int]) -> Array:
    """Return the covariance of a fit, with rows of unit variance."""
    A = products[np.ix_(columns, columns)]
    scale = np.sqrt(np.maximum(np.diagonal(A), NOTHING))
    found: Array = np.linalg.inv(A / np.outer(scale, scale) + RIDGE * np.eye(len(columns))) / np.outer(scale, scale)
    return found


def squares(products: Array, columns: Sequence[int], X: Array) -> float:
    """Return the squares of what parameters leave, from products of columns."""
    A, b = products[np.ix_(columns, columns)], products[columns, -1]
    return float(products[-1, -1] - 2 * X @ b + X @ A @ X)
