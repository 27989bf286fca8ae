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

GRID = 32
"""Values of each unknown shape of a law that are compared."""

LOOKED = 4
"""Of these, those that explain all rows best are compared on rows that are left out."""

FOLDS = 10
"""Stretches of the logs, each of which is predicted by a fit of the others."""

FAST = 0.8
"""Speeds of a joint above this share of the rows are predicted once more, by a fit of the slower ones: a law that holds within
the speeds of a fit alone fails there."""

SURE = 1.5
"""A law is taken when what it gains is this many times the standard deviation of that over the stretches."""

PLAIN = 5.0
"""Its parameter is at least so many sigma away from zero: of a hundred laws and joints none is there by chance."""

SOLID = 0.3
"""Or when it takes this share of the squared error also without the stretch in which it takes most."""

WORSE = 0.25
"""Share of the squared error that a law may add at speeds above those of a fit: an eighth of the error."""

EXCUSED = 2.0
"""Squares at speeds above those of a fit that sigma makes, in multiples of what it makes on average, are no fault of a law."""

WORTH = 0.02
"""Least share of a joint's squared error that a law must take: less is of no use, and of a chain's own errors."""

TINY, NOTHING = 1e-300, 1e-200
"""Squares below the first count as this, and columns whose squares are below the second as none."""

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
    sigmas : float
        How many sigma its parameter is away from zero, with independent rows.
    least : float
        Share that it takes without the stretch in which it takes most.
    beyond : float
        Share that it takes of the squared error at speeds above those of a fit.
    taken : bool
        Whether the joint has it in the end.
    """

    joint: int
    law: str
    share: float
    deviations: float
    sigmas: float
    least: float
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
    added where it takes `WORTH` of the squared error, `SURE` times the standard deviation of that, its parameter is `PLAIN`
    sigma away from zero, and it does no harm to the fastest motion; the one that takes most first. In the end those are dropped
    again that others have made idle.

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
    problem.factors.together.check()
    return _Choice(problem.explicit, candidates).run()


@dataclass(frozen=True, eq=False)
class _Choice:
    problem: Problem
    candidates: Mapping[str, AbstractBlock]

    def run(self) -> FrictionChoice:
        laws: list[tuple[str, ...]] = [()] * self.problem.basis.n
        scores = dict[tuple[int, str], LawScore]()
        while True:
            search = self._search(laws, self.candidates)
            tried = {key: search.score(*key) for key in search.places}
            scores = tried | scores
            found = [_best(tried, j) for j in range(len(laws))]
            if not any(found):
                break
            laws = self._better(laws, found)
        laws = [self._needed(laws, j) if len(own) > 1 else own for j, own in enumerate(laws)]
        kept = (replace(score, taken=score.law in laws[score.joint]) for score in scores.values())
        return FrictionChoice(tuple(laws), tuple(kept))

    def _better(self, laws: Sequence[tuple[str, ...]], found: Sequence[Sequence[str]]) -> list[tuple[str, ...]]:
        """Return the laws with one more of each joint: of its best two that which is better with shapes of its own."""
        each = []
        for rank in (0, 1):
            more = [(*own, names[min(rank, len(names) - 1)]) if names else own for own, names in zip(laws, found, strict=True)]
            each.append(more)
        if each[0] == each[1]:
            return each[0]
        searches = [self._search(more, {}) for more in each]
        chosen, n = list[tuple[str, ...]](), len(laws)
        for j in range(n):
            marks = [(self._drives(search, more[j], j), search.error(j)) for search, more in zip(searches, each, strict=True)]
            chosen.append(each[0][j] if marks[0] <= marks[1] else each[1][j])
        return chosen

    def _drives(self, search: "_Search", own: Sequence[str], j: int) -> bool:
        """Return whether the last law of a joint has a size below zero: a law of another form, stood on its head."""
        block = self.candidates[own[-1]] if own else None
        return isinstance(block, ShapedFriction) and search.products.value(f"{block.law.symbol}{j + 1}") < 0

    def _needed(self, laws: Sequence[tuple[str, ...]], j: int) -> tuple[str, ...]:
        """Return the laws of a joint without those that gain nothing beside the others."""
        own = laws[j]
        for name in laws[j]:
            rest = tuple(other for other in own if other != name)
            search = self._search([*laws[:j], rest, *laws[j + 1 :]], {name: self.candidates[name]})
            if not _worth(search.score(j, name)):
                own = rest
                laws = [*laws[:j], rest, *laws[j + 1 :]]
        return own

    def _search(self, laws: Sequence[tuple[str, ...]], candidates: Mapping[str, AbstractBlock]) -> "_Search":
        """Return the comparison of further laws, beside these with their own shapes."""
        basis = self.problem.basis
        for name in dict.fromkeys(name for own in laws for name in own):
            joints = tuple(j for j, own in enumerate(laws) if name in own)
            basis = basis + OfJoints(self.candidates[name], joints)
        return _Search(_Products.of(settled(self.problem.with_basis(basis)), candidates))


def _worth(score: LawScore) -> bool:
    gains = (score.share > WORTH and score.deviations > SURE) or score.least > SOLID
    return gains and score.sigmas > PLAIN and score.beyond > -WORSE


def _best(tried: Mapping[tuple[int, str], LawScore], j: int) -> list[str]:
    """Return the laws that are worth it at a joint, that which gains most first."""
    worth = {name: score.share for (joint, name), score in tried.items() if joint == j and _worth(score)}
    return sorted(worth, key=lambda name: -worth[name])


@dataclass(frozen=True, eq=False)
class _Search:
    products: "_Products"

    @property
    def places(self) -> list[tuple[int, str]]:
        """Joints and laws that are compared."""
        return [(j, name) for name, j in self.products.places]

    def score(self, j: int, name: str) -> LawScore:
        """Return what a law gains at a joint."""
        (before, left_open), (after, more_open) = self._errors(j, None), self._errors(j, name)
        ratio = np.log(np.maximum(before, TINY) / np.maximum(after, TINY))[:-1]
        spread = float(np.std(ratio, ddof=1) / np.sqrt(FOLDS))
        deviations = float(ratio.mean() / spread) if spread > 0 else 0.0
        share = float(1 - after[:-1].sum() / max(before[:-1].sum(), TINY))
        others = np.delete(np.arange(FOLDS), np.argmax((before - after)[:-1]))
        least = float(1 - after[others].sum() / max(before[others].sum(), TINY))
        # What the noise of the fit makes farther out is no fault of the law.
        beyond = 1 - (after[-1] - EXCUSED * (more_open[-1] - left_open[-1])) / max(before[-1], TINY)
        return LawScore(j, name, share, deviations, self.products.sigmas(name, j), least, float(beyond), taken=False)

    def error(self, j: int) -> float:
        """Return the squared error of a joint on stretches that were not fitted, without further laws."""
        return float(self._errors(j, None)[0][:-1].sum())

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
        least, best, spread = np.inf, 0.0, 0.0
        # The fastest motion has had no say in the shapes: they are those that fit the slower best.
        every = [[]] if law is None else products.places[law, j] if fold == FOLDS else products.likely(law, j)
        for own in every:
            columns = [*range(products.p), *own]
            X = _solved(fitted, columns)
            if (misfit := _squares(fitted, columns, X)) < least:
                least, best = misfit, _squares(judged, columns, X)
                spread = _spread(fitted, judged, columns) if fold == FOLDS else 0.0
        return best, spread


@dataclass(frozen=True, eq=False)
class _Products:
    """Products of columns with each other, P of them with those of all laws at all their starting shapes, and with Y.

    Parameters
    ----------
    start : Problem
        That of the laws that all joints have.
    held : Array, shape (FOLDS + 1, joint, P + 1, P + 1)
        Of what is left out, of every joint: stretch by stretch, and its fastest motion.
    weight : Array, shape (joint,)
        1 over the variance of the joint's error without the laws.
    p : int
        Number of parameters that all joints have.
    places : mapping of (str, int) to list of lists of int
        Which columns a law of a joint has, one list for every combination of its shapes.
    """

    start: Problem
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
        weight = start.factors.rows / np.maximum(level, 1e-300)
        return cls(start, _held(joined, speed), weight, len(start.names), places)

    def value(self, name: str) -> float:
        """Return the estimate of a parameter without further laws."""
        return float(self.start.factors.fit(2).X[self.start.names.index(name)])

    def sigmas(self, law: str, j: int) -> float:
        """Return how many sigma the parameters of a law are away from zero, at the shapes that explain most."""
        columns = [*range(self.p), *self.likely(law, j)[0]]
        X, C = _solved(self._every, columns), _inverse(self._every, columns)
        return float((np.abs(X[self.p :]) / np.sqrt(np.maximum(np.diagonal(C)[self.p :], TINY))).max())

    def likely(self, law: str, j: int) -> list[list[int]]:
        """Return the columns of a law at the shapes that explain all rows best, the best first."""
        if (law, j) not in self._likely:
            misfits = []
            for own in self.places[law, j]:
                columns = [*range(self.p), *own]
                misfits.append(_squares(self._every, columns, _solved(self._every, columns)))
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


def _solved(products: Array, columns: Sequence[int]) -> Array:
    """Return the least-squares solution from products of columns."""
    A, b = products[np.ix_(columns, columns)], products[columns, -1]
    scale = np.sqrt(np.maximum(np.diagonal(A), NOTHING))
    A = A / np.outer(scale, scale) + RIDGE * np.eye(len(columns))
    found: Array = np.linalg.solve(A, b / scale) / scale
    return found


def _spread(products: Array, judged: Array, columns: Sequence[int]) -> float:
    """Return the squares that the sigma of a fit, with rows of unit variance, makes in others."""
    return float(np.sum(_inverse(products, columns) * judged[np.ix_(columns, columns)]))


def _inverse(products: Array, columns: Sequence[int]) -> Array:
    """Return the covariance of a fit, with rows of unit variance."""
    A = products[np.ix_(columns, columns)]
    scale = np.sqrt(np.maximum(np.diagonal(A), NOTHING))
    found: Array = np.linalg.inv(A / np.outer(scale, scale) + RIDGE * np.eye(len(columns))) / np.outer(scale, scale)
    return found


def _squares(products: Array, columns: Sequence[int], X: Array) -> float:
    """Return the squares of what parameters leave, from products of columns."""
    A, b = products[np.ix_(columns, columns)], products[columns, -1]
    return float(products[-1, -1] - 2 * X @ b + X @ A @ X)
