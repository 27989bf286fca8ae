"""Which law of friction each joint has, compared on motion that the parameters were not fitted to."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from identify.arrays import Array
from identify.basis.block import AbstractBlock
from identify.basis.friction.shape import ShapedFriction
from identify.basis.of_joints import OfJoints
from identify.estimators.problem import Problem
from identify.estimators.settle import settled
from identify.judge.held_out import FOLDS, TINY, HeldOut, sigma_squares, solved, squares

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


def choose_friction(problem: Problem, candidates: Mapping[str, AbstractBlock], *, most: int | None = None) -> FrictionChoice:
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
    most : int, optional
        Laws that are added to a joint at most.

    Raises
    ------
    IdentificationError
        If the logs are too long for their rows to be kept, or the motion does not show the parameters.
    """
    problem.require_rows("laws of friction are compared by rows, and ")
    problem.factors.together.check()
    return _Choice(problem.explicit, candidates).run(most)


@dataclass(frozen=True, eq=False)
class _Choice:
    problem: Problem
    candidates: Mapping[str, AbstractBlock]

    def run(self, most: int | None) -> FrictionChoice:
        laws: list[tuple[str, ...]] = [()] * self.problem.basis.n
        scores = dict[tuple[int, str], LawScore]()
        while True:
            search = self._search(laws, self.candidates)
            tried = {key: search.score(*key) for key in search.places}
            scores = tried | scores
            found = [_best(tried, j) for j in range(len(laws))]
            if not any(found):
                break
            before, laws = laws, self._better(laws, found)
            if laws == before or max(map(len, laws)) == most:
                break
        laws = [self._needed(laws, j) if len(own) > 1 else own for j, own in enumerate(laws)]
        kept = (replace(score, taken=score.law in laws[score.joint]) for score in scores.values())
        return FrictionChoice(tuple(laws), tuple(kept))

    def _better(self, laws: Sequence[tuple[str, ...]], found: Sequence[Sequence[str]]) -> list[tuple[str, ...]]:
        """Return the laws with one more of each joint: of its best two that which is better with shapes of its own."""
        first = [(*own, names[0]) if names else own for own, names in zip(laws, found, strict=True)]
        solvable = bool(np.isfinite(self._search(first, {}).errors).all())
        # Where one law cannot be solved for, it must not decide about those of other joints.
        others = first if solvable else list(laws)
        shaped = [any(isinstance(self.candidates[name], ShapedFriction) for name in names[:2]) for names in found]
        plain = (solvable and not own for own in shaped)
        each = enumerate(zip(found, plain, strict=True))
        return [first[j] if only or not names else self._best_of(others, laws[j], names, j) for j, (names, only) in each]

    def _best_of(
        self, others: Sequence[tuple[str, ...]], own: tuple[str, ...], names: Sequence[str], j: int
    ) -> tuple[str, ...]:
        """Return the laws of a joint with the better of its best two; as they are if neither can be solved for."""
        marks = [(True, np.inf, own)]
        for name in names[:2]:
            more = [*others[:j], (*own, name), *others[j + 1 :]]
            search = self._search(more, {})
            marks.append((self._drives(search, more[j], j), float(search.errors[j]), more[j]))
        return min((mark for mark in marks if np.isfinite(mark[1]) or mark[2] == own), key=lambda mark: mark[:2])[2]

    def _drives(self, search: "_Search", own: Sequence[str], j: int) -> bool:
        """Return whether the last law of a joint has a size below zero: a law of another form, stood on its head."""
        block = self.candidates[own[-1]] if own else None
        return isinstance(block, ShapedFriction) and search.products.value(block.law.symbol, j) < 0

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
        return _Search(HeldOut.of(settled(self.problem.with_basis(basis)), candidates))


def _worth(score: LawScore) -> bool:
    gains = (score.share > WORTH and score.deviations > SURE) or score.least > SOLID
    return gains and score.sigmas > PLAIN and score.beyond > -WORSE


def _best(tried: Mapping[tuple[int, str], LawScore], j: int) -> list[str]:
    """Return the laws that are worth it at a joint, that which gains most first."""
    worth = {name: score.share for (joint, name), score in tried.items() if joint == j and _worth(score)}
    return sorted(worth, key=lambda name: -worth[name])


@dataclass(frozen=True, eq=False)
class _Search:
    products: HeldOut

    @property
    def places(self) -> list[tuple[int, str]]:
        """Joints and laws that are compared."""
        return [(j, name) for name, j in self.products.places]

    def score(self, j: int, name: str) -> LawScore:
        """Return what a law gains at a joint."""
        (before, left_open), (after, more_open) = self._errors(j, None), self._errors(j, name)
        if not np.isfinite(after).all():  # nothing that could be solved
            return LawScore(j, name, -np.inf, -np.inf, 0.0, -np.inf, -np.inf, taken=False)
        ratio = np.log(np.maximum(before, TINY) / np.maximum(after, TINY))[:-1]
        spread = float(np.std(ratio, ddof=1) / np.sqrt(FOLDS))
        deviations = float(ratio.mean() / spread) if spread > 0 else 0.0
        share = float(1 - after[:-1].sum() / max(before[:-1].sum(), TINY))
        others = np.delete(np.arange(FOLDS), np.argmax((before - after)[:-1]))
        least = float(1 - after[others].sum() / max(before[others].sum(), TINY))
        # What the noise of the fit makes farther out is no fault of the law.
        beyond = 1 - (after[-1] - EXCUSED * (more_open[-1] - left_open[-1])) / max(before[-1], TINY)
        return LawScore(j, name, share, deviations, self.products.sigmas(name, j), least, float(beyond), taken=False)

    @property
    def errors(self) -> Array:
        """Squared error of each joint on stretches that were not fitted, without further laws, shape (joint,)."""
        return np.array([self._errors(j, None)[0][:-1].sum() for j in range(self.products.start.basis.n)])

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
        least, best, spread = np.inf, np.inf, 0.0
        # The fastest motion has had no say in the shapes: they are those that fit the slower best.
        every = [[]] if law is None else products.places[law, j] if fold == FOLDS else products.likely(law, j)
        for own in every:
            columns = [*range(products.p), *own]
            X = solved(fitted, columns)
            if (misfit := squares(fitted, columns, X)) < least:
                least, best = misfit, squares(judged, columns, X)
                spread = sigma_squares(fitted, judged, columns) if fold == FOLDS else 0.0
        return best, spread
