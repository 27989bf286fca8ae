"""Which law of friction each joint has, compared on motion that the parameters were not fitted to."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise, product

import numpy as np

from identify.arrays import Array
from identify.basis.block import AbstractBlock
from identify.basis.friction.shape import ShapedFriction
from identify.basis.joint_law import AbstractFriction
from identify.basis.of_joints import OfJoints
from identify.estimators.problem import Problem
from identify.estimators.settle import Candidates, settled

GRID = 7
"""Values of each unknown shape of a law that are compared."""

FOLDS = 10
"""Stretches of the logs, each of which is predicted by a fit of the others."""

FAST = 0.8
"""Speeds of a joint above this share of the rows are predicted once more, by a fit of the slower ones: a law that holds within
the speeds of a fit alone fails there."""

SURE = 3.0
"""A law is taken when what it gains is this many times the standard deviation of that over the stretches."""

WORTH = 0.02
"""Least share of a joint's squared error that a law must take: less is of no use, and of a chain's own errors."""

TINY = 1e-300

RIDGE = 1e-11
"""Share of its diagonal that a matrix of products may lack before columns count as dependent."""


@dataclass(frozen=True)
class LawScore:
    """What a law changes on motion that was not fitted.

    Parameters
    ----------
    joint : int
        From 0.
    law : str
        Its name.
    share : float
        Of the joint's squared error, how much it takes; negative if it adds to it.
    deviations : float
        What it takes of the logarithm of the squared errors of the stretches, on average, in standard deviations of that.
    beyond : float
        Share that it takes of the squared error at speeds above those of a fit.
    taken : bool
        Whether the joint has it in the end.
    """

    joint: int
    law: str
    share: float
    deviations: float
    beyond: float
    taken: bool


@dataclass(frozen=True)
class FrictionChoice:
    """Laws of friction that each joint has beside those of the basis.

    Parameters
    ----------
    laws : tuple of tuple of str
        Names, joint by joint.
    scores : tuple of LawScore
        What was compared, in the order in which it was decided.
    """

    laws: tuple[tuple[str, ...], ...]
    scores: tuple[LawScore, ...]


def choose_friction(problem: Problem, candidates: Mapping[str, AbstractBlock]) -> FrictionChoice:
    """Return the laws that predict torques of motion that was not fitted better, joint by joint.

    Stretches of the logs are left out one by one (cross-validation), and the fastest motion of each joint once more. A law is
    added where it takes `WORTH` of the squared error, `SURE` times the standard deviation of that, and takes of that of the
    fastest motion, too; the one that takes most first. In the end those are dropped again that others have made idle.

    Parameters
    ----------
    problem : Problem
        Of one run, with the laws that all joints have.
    candidates : mapping of str to AbstractBlock
        What they may have beside these, by name.

    Raises
    ------
    IdentificationError
        If the logs are too long for their rows to be kept, or the motion does not show the parameters.
    """
    problem.require_rows("laws of friction are compared by rows, and ")
    start = settled(problem.explicit)
    start.factors.together.check()
    return _Search(start, candidates).run()


@dataclass(frozen=True, eq=False)
class _Search:
    start: Problem
    candidates: Mapping[str, AbstractBlock]

    def run(self) -> FrictionChoice:
        n = self.start.basis.n
        laws: list[tuple[str, ...]] = [()] * n
        scores = dict[tuple[int, str], LawScore]()
        while True:
            found = [self._best(laws, j, scores) for j in range(n)]
            if not any(found):
                break
            laws = [(*own, name) if name else own for own, name in zip(laws, found, strict=True)]
        laws = [self._needed(laws, j) for j in range(n)]
        kept = (replace(score, taken=score.law in laws[score.joint]) for score in scores.values())
        return FrictionChoice(tuple(laws), tuple(kept))

    def _best(self, laws: Sequence[tuple[str, ...]], j: int, scores: dict[tuple[int, str], LawScore]) -> str | None:
        """Return the law that gains most at a joint, if one is worth it."""
        untried = [name for name in self.candidates if name not in laws[j] and (name, j) in self._products.places]
        tried = {name: self._score(laws, j, name) for name in untried}
        scores |= {(j, name): score for name, score in tried.items()}
        worth = {name: s.share for name, s in tried.items() if s.share > WORTH and s.deviations > SURE and s.beyond > 0}
        return max(worth, key=lambda name: worth[name], default=None)

    def _needed(self, laws: Sequence[tuple[str, ...]], j: int) -> tuple[str, ...]:
        """Return the laws of a joint without those that gain nothing beside the others."""
        own = laws[j]
        for name in laws[j]:
            rest = tuple(other for other in own if other != name)
            score = self._score([*laws[:j], rest, *laws[j + 1 :]], j, name)
            if not (score.share > WORTH and score.deviations > SURE and score.beyond > 0):
                own = rest
                laws = [*laws[:j], rest, *laws[j + 1 :]]
        return own

    def _score(self, laws: Sequence[tuple[str, ...]], j: int, name: str) -> LawScore:
        """Return what a law gains at a joint, beside those that the joints have."""
        more = [*laws[:j], (*laws[j], name), *laws[j + 1 :]]
        before, after = self._errors(tuple(laws), j), self._errors(tuple(more), j)
        ratio = np.log(np.maximum(before, TINY) / np.maximum(after, TINY))
        spread = float(np.std(ratio[:-1], ddof=1) / np.sqrt(FOLDS))
        deviations = float(ratio[:-1].mean() / spread) if spread > 0 else 0.0
        share = float(1 - after[:-1].sum() / max(before[:-1].sum(), TINY))
        return LawScore(j, name, share, deviations, float(1 - np.exp(-ratio[-1])), taken=False)

    def _errors(self, laws: tuple[tuple[str, ...], ...], j: int) -> Array:
        """Return the squared errors of a joint's rows in every stretch and in the fastest motion, none of which was fitted."""
        key = laws, j
        if key not in self._known:
            self._known[key] = np.array([self._predicted(laws, j, k) for k in range(FOLDS + 1)])
        return self._known[key]

    @cached_property
    def _known(self) -> dict[tuple[tuple[tuple[str, ...], ...], int], Array]:
        return {}

    def _predicted(self, laws: Sequence[tuple[str, ...]], j: int, fold: int) -> float:
        """Return the squared error of a joint in a stretch, by a fit of the rest; shapes are those that fit the rest best."""
        products = self._products
        judged, fitted = products.held[fold][j], products.fitted(fold, j)
        least, best = np.inf, 0.0
        for columns in products.choices(laws, j):
            X = _solved(fitted, columns)
            if (misfit := _squares(fitted, columns, X)) < least:
                least, best = misfit, _squares(judged, columns, X)
        return best

    @cached_property
    def _products(self) -> "_Products":
        return _Products.of(self.start, self.candidates)


@dataclass(frozen=True, eq=False)
class _Products:
    """Products of columns with each other, P of them with those of all laws at all their starting shapes, and with Y.

    Parameters
    ----------
    held : Array, shape (FOLDS + 1, joint, P + 1, P + 1)
        Of what is left out, of every joint: stretch by stretch, and its fastest motion.
    weight : Array, shape (joint,)
        1 over the joint's squared error without the laws.
    p : int
        Number of parameters that all joints have.
    places : mapping of (str, int) to list of lists of int
        Which columns a law of a joint has, one list for every combination of its shapes.
    """

    held: Array
    weight: Array
    p: int
    places: Mapping[tuple[str, int], list[list[int]]]

    @classmethod
    def of(cls, start: Problem, candidates: Mapping[str, AbstractBlock]) -> "_Products":
        X, basis, places = start.factors.fit(2).X, start.basis, dict[tuple[str, int], list[list[int]]]()
        for law, block in candidates.items():
            there = {p.joint for p in block.parameters(basis.n) if p.name in basis.names}
            shaped, first = _at_all_shapes(block), len(basis.names)
            made = OfJoints(shaped.adapted(start.basis, X), tuple(j for j in range(basis.n) if j not in there))
            basis = basis + made
            for j in made.joints:
                own = [first + i for i, parameter in enumerate(made.parameters(basis.n)) if parameter.joint == j]
                places[law, j] = [[i] for i in own] if isinstance(shaped, Candidates) else [own]
        basis = basis + _Speed()
        rows = start.with_basis(basis).rows
        joined = np.swapaxes(rows.joined.reshape(-1, rows.kinds, len(basis.names) + 1), 0, 1)
        first = len(basis.names) - basis.n
        speed = np.abs(np.array([joined[j, :, first + j] for j in range(basis.n)]))
        joined = np.concatenate([joined[..., :first], joined[..., -1:]], axis=-1)
        level = start.factors.squares(X)
        return cls(_held(joined, speed), 1 / np.maximum(level, 1e-300), len(start.names), places)

    def fitted(self, fold: int, j: int) -> Array:
        """Return the products of all rows but those that are left out, weighted, shape (P + 1, P + 1)."""
        key = fold, j if fold == FOLDS else -1
        if key not in self._known:
            left = self.weight * np.where(np.arange(len(self.weight)) == j, 1.0, 0.0 if fold == FOLDS else 1.0)
            every = np.einsum("k,kab->ab", self.weight, self.held[:FOLDS].sum(axis=0))
            self._known[key] = every - np.einsum("k,kab->ab", left, self.held[fold])
        return self._known[key]

    @cached_property
    def _known(self) -> dict[tuple[int, int], Array]:
        return {}

    def choices(self, laws: Sequence[tuple[str, ...]], j: int) -> list[list[int]]:
        """Return the columns of the parameters, for every combination of shapes of a joint; of others the middle ones."""
        others = [i for k, own in enumerate(laws) if k != j for law in own for i in _middle(self.places[law, k])]
        own = product(*(self.places[law, j] for law in laws[j]))
        return [[*range(self.p), *others, *(i for columns in choice for i in columns)] for choice in own]


class _Speed(AbstractFriction):
    """Velocities of the rows."""

    symbol = "speed of row "
    unit = "rad/s"

    def force(self, q: Array, qd: Array) -> Array:
        del q
        return qd


def _at_all_shapes(block: AbstractBlock) -> AbstractBlock:
    """Return a block with a parameter for every combination of starting shapes, in the place of unknown shapes."""
    if not isinstance(block, ShapedFriction):
        return block
    grid = product(*(shape.grid(GRID) for shape in block.shapes))
    return Candidates(block.law, tuple(dict(zip((s.setting for s in block.shapes), at, strict=True)) for at in grid))


def _held(joined: Array, speed: Array) -> Array:
    """Return the products of what is left out, shape (FOLDS + 1, joint, P + 1, P + 1), of rows (joint, time, P + 1)."""
    ends = np.linspace(0, joined.shape[1], FOLDS + 1).round().astype(int)
    stretches = [joined[:, a:b] for a, b in pairwise(ends)]
    moving = [np.quantile(v[v > 0], FAST) if (v > 0).any() else np.inf for v in speed]
    fast = joined * (speed > np.array(moving)[:, None])[..., None]
    return np.array([np.matmul(np.swapaxes(x, -1, -2), x) for x in (*stretches, fast)])


def _middle(choices: list[list[int]]) -> list[int]:
    return choices[len(choices) // 2]


def _solved(products: Array, columns: Sequence[int]) -> Array:
    """Return the least-squares solution from products of columns."""
    A, b = products[np.ix_(columns, columns)], products[columns, -1]
    scale = np.sqrt(np.maximum(np.diagonal(A), 1e-300))
    A = A / np.outer(scale, scale) + RIDGE * np.eye(len(columns))
    found: Array = np.linalg.solve(A, b / scale) / scale
    return found


def _squares(products: Array, columns: Sequence[int], X: Array) -> float:
    """Return the squares of what parameters leave, from products of columns."""
    A, b = products[np.ix_(columns, columns)], products[columns, -1]
    return float(products[-1, -1] - 2 * X @ b + X @ A @ X)
