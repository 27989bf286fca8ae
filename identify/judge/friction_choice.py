"""Which law of friction each joint has, compared on motion that the parameters were not fitted to."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from idbench.identify.arrays import combined
from idbench.identify.basis.block import FRICTION, AbstractBlock
from idbench.identify.basis.friction.laws import TanhFriction
from idbench.identify.basis.friction.shape import ShapedFriction
from idbench.identify.basis.of_joints import OfJoints
from idbench.identify.estimators.problem import Problem
from idbench.identify.estimators.settle import settled
from idbench.identify.judge.held_out import HeldOutProducts, LawScore, gain
from idbench.identify.signals.masks import NoMask
from idbench.identify.signals.signals import State

SURE = 1.5  # A law is taken when what it gains is this many times the standard deviation of that over the stretches
PLAIN = 5.0  # Its parameter is at least so many sigma away from zero: of a hundred laws and joints none is there by chance

SOLID = 0.2
"""Or when it takes this share of the squared error also without the stretch in which it takes most. From 0.1 to 0.3 no law is
taken in 12 logs of three simulated robots that have none; above 0.25 a TX40's third joint lacks its load, half of its error."""

WORSE = 0.25  # Share of the squared error that a law may add at speeds above those of a fit: an eighth of the error
BEST = 2  # So many of the laws that take most are compared with shapes that are their own
BEYOND = (-2.0, -1.0, 1.0, 2.0)  # Speeds at which friction must not fall, over the highest of the logs
WORTH = 0.02  # Least share of a joint's squared error that a law must take: less is of no use, and of a chain's own errors


@dataclass(frozen=True)
class FrictionChoice:
    """Laws of friction that each joint has beside those of the basis."""

    laws: tuple[tuple[str, ...], ...]
    """Names, joint by joint."""
    scores: tuple[LawScore, ...]
    """What was compared, in the order in which it was decided."""
    idle: tuple[tuple[str, ...], ...] = ()
    """Letters of laws of the basis in whose place the joint has another, joint by joint."""


def choose_friction(problem: Problem, candidates: Mapping[str, AbstractBlock], *, most: int | None = None) -> FrictionChoice:
    """Return the laws that predict torques of motion that was not fitted better, joint by joint.

    Stretches of the logs are left out one by one (cross-validation), and the fastest motion of each joint once more. A law is
    added where it takes `WORTH` of the squared error, `SURE` times the standard deviation of that, its parameter is `PLAIN`
    sigma away from zero, and it does no harm to the fastest motion; the one that takes most first. In the end those are dropped
    again that others have made idle; so is Coulomb friction, where a law without its jump stands in its place and nothing is
    masked.

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
        If the logs are too long for their rows to be kept, or the motion does not excite the parameters.
    """
    problem.require_rows("laws of friction are compared by rows, and ")
    problem.factors.together.check()
    return _Choice(problem.explicit, candidates).run(most)


@dataclass(frozen=True, eq=False)
class _Choice:
    problem: Problem
    candidates: Mapping[str, AbstractBlock]

    def run(self, most: int | None) -> FrictionChoice:
        """Return the laws found by forward selection: laws(k+1) = laws(k) + argmax of the explained held-out squares."""
        laws: list[tuple[str, ...]] = [()] * self.problem.basis.n
        scores = dict[tuple[int, str], LawScore]()
        while True:
            search = self._search(laws, self.candidates)
            tried = {(j, name): search.score(j, name) for name, j in search.places}
            scores |= tried
            found = [_best(tried, j) for j in range(len(laws))]
            if not any(found):
                break
            before, laws = laws, self._better(laws, found)
            if laws == before or max(map(len, laws)) == most:
                break
        laws = [self._needed(laws, j) if len(own) > 1 else own for j, own in enumerate(laws)]
        for j in range(len(laws)):
            if score := self._in_place(laws, j):
                laws[j], scores[j, score.law] = (*laws[j], score.law), score
        kept = (replace(score, taken=score.law in laws[score.joint]) for score in scores.values())
        return FrictionChoice(tuple(laws), tuple(kept), tuple(self._idle(laws, j) for j in range(len(laws))))

    def _better(self, laws: Sequence[tuple[str, ...]], found: Sequence[Sequence[str]]) -> list[tuple[str, ...]]:
        """Return the laws with one more of each joint: of its best two that which is better with shapes of its own."""
        first = [(*own, names[0]) if names else own for own, names in zip(laws, found, strict=True)]
        search = self._search(first, {})
        solvable = bool(np.isfinite(search.errors).all())
        # Where one law cannot be solved for, it must not decide about those of other joints.
        others = first if solvable else list(laws)
        shaped = [any(isinstance(self.candidates[name], ShapedFriction) for name in names[:BEST]) for names in found]
        # What is not compared with others is asked here whether it is possible.
        plain = (solvable and not own and not self._spoils(search, laws, j) for j, own in enumerate(shaped))
        each = enumerate(zip(found, plain, strict=True))
        return [first[j] if only or not names else self._best_of(others, laws[j], names, j) for j, (names, only) in each]

    def _best_of(
        self, others: Sequence[tuple[str, ...]], own: tuple[str, ...], names: Sequence[str], j: int
    ) -> tuple[str, ...]:
        """Return the laws of a joint with the better of its best two that are determined; as they are if there is none.

        A law whose shape the motion leaves open is another one in disguise: arctan about a velocity above all those of a log is
        viscous friction, and the two of them grow without limit against each other.
        """
        marks = list[tuple[bool, float, tuple[str, ...]]]()
        for name in names:
            more = [*others[:j], (*own, name), *others[j + 1 :]]
            search, block = self._search(more, {}), self.candidates[name]
            size = search.in_sigmas(block.law.symbol, j) if isinstance(block, ShapedFriction) else np.inf
            error = float(search.errors[j])
            if np.isfinite(error) and abs(size) > PLAIN and not self._spoils(search, [*others[:j], own, *others[j + 1 :]], j):
                # A size below zero is a law of another form, stood on its head.
                marks.append((size < 0, error, more[j]))
            if len(marks) == BEST:
                break
        return min(marks)[2] if marks else own

    def _spoils(self, search: HeldOutProducts, before: Sequence[tuple[str, ...]], j: int) -> bool:
        """True if friction of a joint newly falls at speeds beyond those of the logs."""
        return falls(search.start, j) and not falls(self._search(before, {}).start, j)

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

    def _in_place(self, laws: Sequence[tuple[str, ...]], j: int) -> LawScore | None:
        """Gain of tanh over Coulomb friction on held-out motion, if there is any.

        Beside it, as laws are compared at first, the two share what they explain. Fast motion is not asked: there both are the
        same.
        """
        for name, block in self.candidates.items():
            gone = [] if any(map(self._replaced, laws[j])) else self._letters(j, self._replaced(name))
            if not gone or not (isinstance(block, ShapedFriction) and isinstance(block.law, TanhFriction)):
                continue
            more = [*laws[:j], (*laws[j], name), *laws[j + 1 :]]
            before, after = (s.squares(j) for s in (self._search(laws, {}), self._search(more, {}, gone)))
            share, deviations, least = gain(before, after)
            if np.isfinite(after).all() and share > WORTH and deviations > SURE:
                return LawScore(j, name, share, deviations, np.nan, least, np.nan, taken=True)
        return None

    def _replaced(self, name: str) -> str:
        """Return the letters in whose place a candidate stands."""
        block = self.candidates[name]
        return block.law.replaces if isinstance(block, ShapedFriction) else ""

    def _letters(self, j: int, letters: str) -> list[str]:
        return [p.name for p in self.problem.basis.parameters if p.joint == j and p.symbol == letters]

    def _idle(self, laws: Sequence[tuple[str, ...]], j: int) -> tuple[str, ...]:
        """Return the letters of laws of the basis without which a joint that has others in their place is predicted as well.

        None where a mask takes the instants near rest: without its jump friction would be too small there.
        """
        if not isinstance(self.problem.chain.mask, NoMask):
            return ()
        letters = {self._replaced(name) for name in laws[j]}
        if not (names := [name for x in letters for name in self._letters(j, x)]):
            return ()
        with_it, without = (self._search(laws, {}, gone).errors[j] for gone in ([], names))
        return tuple(letters) if (1 - WORTH) * without < with_it else ()

    def _search(
        self, laws: Sequence[tuple[str, ...]], candidates: Mapping[str, AbstractBlock], gone: Sequence[str] = ()
    ) -> HeldOutProducts:
        """Return the comparison of further laws, beside these with their own shapes, without some parameters."""
        key = tuple(laws), tuple(gone)
        if key not in self._settled:
            basis = self.problem.basis.without(*gone) if gone else self.problem.basis
            for name in dict.fromkeys(name for own in laws for name in own):
                joints = tuple(j for j, own in enumerate(laws) if name in own)
                basis = basis + OfJoints(self.candidates[name], joints)
            self._settled[key] = settled(self.problem.with_basis(basis))
        return HeldOutProducts.of(self._settled[key], candidates)

    @cached_property
    def _settled(self) -> dict[tuple[tuple[tuple[str, ...], ...], tuple[str, ...]], Problem]:
        """Problems by the laws of each joint and what they are without: some are asked for several times."""
        return {}


def falls(problem: Problem, j: int) -> bool:
    """True if the identified friction is less at twice the highest speed of the logs, in either direction.

    Laws that share what they explain, such as arctan and a negative viscous friction, do that; no drive does.
    """
    states = [signals.state for signals in problem.explicit.signals]
    laws, top = problem.basis.only(FRICTION), max(float(np.abs(state.qd[..., j, :]).max()) for state in states)
    qd = np.zeros((laws.n, len(BEYOND)))
    qd[j] = top * np.array(BEYOND)
    conditions = {name: np.mean(x, axis=-1, keepdims=True) + np.zeros(qd.shape) for name, x in states[0].conditions.items()}
    state = State(np.zeros(qd.shape), qd, np.zeros_like, conditions)
    X = problem.factors.fit(2).X[[problem.basis.places[p] for p in laws.parameters]]
    tau = combined(laws.explicit(state), X, np.zeros(qd.shape))[j]
    return bool(tau[3] < tau[2] or tau[0] > tau[1])


def _worth(score: LawScore) -> bool:
    gains = (score.share > WORTH and score.deviations > SURE) or score.least > SOLID
    return gains and score.sigmas > PLAIN and score.beyond > -WORSE


def _best(tried: Mapping[tuple[int, str], LawScore], j: int) -> list[str]:
    """Return the laws that are worth it at a joint, that which gains most first."""
    worth = {name: score.share for (joint, name), score in tried.items() if joint == j and _worth(score)}
    return sorted(worth, key=lambda name: -worth[name])
