"""Small mistakes that the residuals of a fit show: one test each, against residuals as correlated as they are."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy

from idbench.identify.arrays import TINY, Array
from idbench.identify.errors import IdentificationError
from idbench.identify.estimators.log_rows import split_by_log
from idbench.identify.estimators.problem import Problem
from idbench.identify.judge.delay_step import torque_lateness
from idbench.identify.judge.mistake_rows import Candidate, MistakeRows
from idbench.identify.judge.mistakes import COLLISION, GAIN, RARE
from idbench.identify.judge.stretches import errors_of_stretches, left_unexplained, noise_errors, scatter_of_sums
from idbench.identify.judge.suspect import Suspect
from idbench.identify.judge.torque_gains import TorqueGains

APART = 1e-2
"""Share of the squares of several columns that parameters must leave, and for one to be distinct from the others. With 1e-4,
encoders in slow motion are called a tilt in 3 of 24 logs without one."""

CERTAIN = 1e-6
"""Probability that any of all mistakes seems as significant by chance, below which one is suspected. Counts of encoders are not
Gaussian: with 1e-3, 5 of 120 logs without a fault, of four robots, have a suspect, all with 12 bits."""

WORTH, MATTERS = 0.98, 0.02
"""Share of an error on stretches that were not fitted that a mistake may leave, and error [%] below which none matters: a chain
has errors of its own, of some 1e-5 %, and no drive is known to a fiftieth of a per cent."""

PROOF, MOSTLY, LEFT = 0.5, 1 / 9, 10.0
"""Share of squared held-out errors beyond noise, at the joint where they fall most, that a named mistake may leave; and that
which it may leave if the error is still above so many per cent of the torque, as something else is wrong, too."""
PUSHED = 0.02  # Torque of a push, over the rms of the joint's, above which it is one: less is what any model leaves somewhere
ALIKE = 0.8  # Share of what a mistake explains that another one must explain to be its alternative
NEARLY_ALL = 0.95  # Share of the gain of the most likely one from which on a more common one is named before it
MOST = 3  # Mistakes that are looked for, one beside the other
MEDIAN = 0.4549  # Of chi squared with one degree of freedom
FEWEST, MANY = 2, 100_000  # Rows a parameter, and rows at most: hundreds of columns of as many take a GB
SOME = 6  # One of so many tests is made whatever it says, to see how they scatter


def small_mistakes(problem: Problem, X: Array) -> tuple[Suspect, ...]:
    """Return the mistakes that residuals show, each beside those before it, and proved on stretches that were not fitted.

    With whitened rows of a fit and the column c of a mistake, c' what parameters leave of it,

        b = c' r / c'c',   var b = sum over kinds and lags of rho(l) (c' * c')(l) / (c'c')^2

    rho being the autocorrelation of the residuals with it (Hann taper, `MEMORY`), not less than that of white
    ones. Of those that are sure that counts which makes the rows most likely.

    Parameters
    ----------
    problem : Problem
        Of one run, whose rows are kept.
    X : Array, shape (p,)
        Its estimate.
    """
    explicit = problem.explicit
    if not FEWEST * len(X) < (count := len(explicit.rows.time)) < MANY:
        raise IdentificationError(f"{count} rows are too few or too many to test mistakes beside {len(X)} parameters")
    rows = MistakeRows(explicit.parts, explicit.basis, X)
    return tuple(_Search(explicit, rows, rows.every()).found())


@dataclass(frozen=True, eq=False)
class _Tested:
    candidate: Candidate
    left: Array
    """Directions of what parameters leave of its columns, shape (r, g)."""
    size: Array
    sigma: Array
    signal: Array
    """What it explains of the residuals, shape (r,)."""
    chi2: float
    gain: float
    """What it takes of minus twice the logarithm of the likelihood, less what as many columns of noise take."""
    of_all: bool
    """Whether it is one of those that are tested whatever they say."""


@dataclass(frozen=True, eq=False)
class _Search:
    problem: Problem
    rows: MistakeRows
    every: Sequence[Candidate]

    def found(self) -> list[Suspect]:
        """Mistakes, each the most likely one beside those before: c(k+1) = argmax gain(c | W, c(1), ..., c(k)).

        It counts if it is as sure beside what the tests of all others scatter once it is explained: of noise they scatter by 1.
        It is named if, beside the others, at least half of the error that nothing else explains goes (`PROOF`).
        """
        every, taken, found = self.every, list[Candidate](), list[Suspect]()
        tested = self._all_tested(every, taken)
        while len(taken) < MOST:
            for best, errors in self._proved(tested, taken):
                rest = [c for c in every if c.key != best.candidate.key]
                left = self._all_tested(rest, [*taken, best.candidate])
                p = self._by_chance(best.left.shape[1], best.chi2 / _scatter_of(left))
                if p < CERTAIN:
                    found.append(self._suspect(best, tested, errors, p))
                    break
            else:
                break
            every, tested = rest, left
            taken.append(best.candidate)
        return self._named(found, taken)

    def _named(self, found: Sequence[Suspect], taken: Sequence[Candidate]) -> list[Suspect]:
        """Those that are proved beside the others; without the least proved one, the others must be."""
        if not found:
            return []
        noise, after = noise_errors(self.problem), self._held_out(taken)
        shares = list[float]()
        for k, candidate in enumerate(taken):
            before = self._held_out([*taken[:k], *taken[k + 1 :]])
            j = int(np.argmax(np.log(before) - np.log(after)))
            share = float(left_unexplained(before, after, noise)[j])
            once = candidate.mistake is COLLISION  # which nothing predicts that happened before or after
            shares.append(0.0 if once else share if share <= MOSTLY or after[j] <= LEFT else 1.0)
        worst = int(np.argmax(shares))
        if shares[worst] <= PROOF:
            return list(found)
        return self._named([*found[:worst], *found[worst + 1 :]], [*taken[:worst], *taken[worst + 1 :]])

    def _all_tested(self, every: Sequence[Candidate], taken: Sequence[Candidate]) -> list[_Tested]:
        """Return tests of mistakes beside others."""
        W = np.concatenate([self._W, *(self._padded(c.white) for c in taken)], axis=1)
        Q = np.linalg.qr(W)[0]
        e = self._Y - Q @ (Q.T @ self._Y)
        own = e[: len(e) - len(self._known)]
        there = {(c.key, c.mistake.setting) for c in taken}
        looked_for = (*self.rows.pushed(own), *self.rows.shaken(own), *self.rows.rippled(own))
        candidates = [*every, *(c for c in looked_for if (c.key, c.mistake.setting) not in there)]
        each = ((c, i % SOME == 0) for i, c in enumerate(candidates))
        return [one for c, of_all in each if (one := self._tested(c, Q, e, of_all=of_all)) is not None]

    def _by_chance(self, columns: int, chi2: float) -> float:
        """Return the probability that any of all mistakes, of so many columns, seems as significant by chance."""
        return min(1.0, (len(self.every) + self.rows.looks) * float(scipy.special.chdtrc(columns, chi2)))

    def _proved(self, tested: Sequence[_Tested], taken: Sequence[Candidate]) -> Iterator[tuple[_Tested, tuple[float, float]]]:
        """Yield the sure ones, the most likely first, that predict stretches better that were not fitted, and errors [%]."""
        before = self._held_out(taken)
        sure = [t for t in tested if t.gain > 0 and self._by_chance(t.left.shape[1], t.chi2) < CERTAIN]
        most = max((t.gain for t in sure), default=0.0)
        # Of those that explain nearly the same, the most common comes first.
        by_rank = sorted(
            sure, key=lambda t: (t.candidate.mistake.rank, -t.gain) if t.gain > NEARLY_ALL * most else (RARE, -t.gain)
        )
        for one in by_rank[:MOST]:
            after = self._held_out([*taken, one.candidate])
            # What happened once cannot be predicted; without it, the rest is.
            j = int(np.argmax(np.log(before) - np.log(after)))
            better = np.sum(np.log(after)) < np.sum(np.log(before)) and max(after[j], MATTERS) < WORTH * before[j]
            if better or (one.candidate.mistake is COLLISION and self._pushes(one, float(before.max()))):
                yield one, (float(before[j]), float(after[j]))

    def _pushes(self, one: _Tested, before: float) -> bool:
        """True if a push is large beside the torque of its joint; what happens once cannot be predicted."""
        rows = self.problem.rows
        level = float(np.sqrt(np.mean(rows.Y[(rows.group == one.candidate.joint) & rows.valid] ** 2)))
        return before > MATTERS and bool(np.abs(one.size).max() > PUSHED * level)

    @cached_property
    def _gains(self) -> TorqueGains:
        return TorqueGains.of(self.problem)

    @cached_property
    def _known(self) -> Array:
        """Rows [W Y] of what is known before, shape (m, p + 1)."""
        prior = self.problem.start.factor.prior
        return np.zeros((0, len(self.problem.names) + 1)) if prior is None else prior

    @cached_property
    def _W(self) -> Array:
        """Whitened W, and below what is known before, shape (r + m, p)."""
        return np.concatenate([*(part.whitening.whiten(part.unbiased.W) for part in self.problem.parts), self._known[:, :-1]])

    @cached_property
    def _Y(self) -> Array:
        each = ((part.whitening, part.rows.Y[:, None]) for part in self.problem.parts)
        return np.concatenate([*(white.whiten(Y)[:, 0] for white, Y in each), self._known[:, -1]])

    def _padded(self, columns: Array) -> Array:
        return np.concatenate([columns, np.zeros((len(self._known), columns.shape[1]))])

    def _tested(self, candidate: Candidate, Q: Array, e: Array, *, of_all: bool) -> _Tested | None:
        """Return a test; None where parameters leave nothing. What white residuals excuse has chi2 = 0, if not `of_all`."""
        c = self._padded(candidate.white)
        left = c - Q @ (Q.T @ c)
        left -= Q @ (Q.T @ left)
        size = np.linalg.norm(left, axis=0)
        shown = size**2 > (candidate.mistake.left if c.shape[1] == 1 else APART) * np.sum(c**2, axis=0)
        if not shown.any():
            return None
        # Columns that are nearly each other's multiples count by what they have in common.
        U, s, axes = np.linalg.svd(left[:, shown] / size[shown], full_matrices=False)
        some = s**2 > APART * s[0] ** 2
        U, turn = U[:, some], (axes[some].T / s[some]) / size[shown][:, None]
        b, own = U.T @ e, len(e) - len(self._known)
        rest = e - U @ b
        gain = self._unlikely(e[:own]) - self._unlikely(e[:own] - U[:own] @ b) - len(b) * np.log(own)
        if not of_all and not self._may_matter(e[:own], b):
            return _Tested(candidate, U[:own], np.zeros(0), np.zeros(0), U[:own] @ b, 0.0, gain, of_all)
        parts = self.problem.parts
        each = zip(parts, split_by_log(U[:own], parts), split_by_log(rest[:own], parts), strict=True)
        V = sum((scatter_of_sums(part, x, r) for part, x, r in each), start=np.zeros(()))
        chi2 = float(b @ np.linalg.solve(V, b))
        sizes, sigma = np.zeros((2, len(size)))
        sizes[shown], sigma[shown] = turn @ b, np.sqrt(np.sum((turn @ V) * turn, axis=1))
        if (candidate.mistake.positive and sizes.min() < 0) or np.abs(sizes).max() > self.rows.most(candidate):
            return None
        return _Tested(candidate, U[:own], sizes, sigma, U[:own] @ b, chi2, gain, of_all)

    def _may_matter(self, e: Array, b: Array) -> bool:
        """True if a mistake may be significant: correlated residuals scatter its size more than white ones."""
        rows = self.problem.rows
        least = float(np.min(np.sum(rows.by_kind(e * rows.valid) ** 2, axis=-1) / np.maximum(rows.count, 1)))
        return self._by_chance(len(b), float(b @ b) / max(least, TINY)) < CERTAIN

    def _unlikely(self, e: Array) -> float:
        """Return minus twice the logarithm of the likelihood, with a level of each kind."""
        rows = self.problem.rows
        squares = np.sum(rows.by_kind(e * rows.valid) ** 2, axis=-1)
        return float(np.sum(rows.count * np.log(np.maximum(squares, TINY))))

    def _suspect(self, best: _Tested, tested: Sequence[_Tested], errors: tuple[float, float], p: float) -> Suspect:
        signal, candidate = best.signal, best.candidate
        others = list[tuple[str, int | None]]()
        for other in sorted(tested, key=lambda t: -t.gain):
            key = other.candidate.key
            explained = float(np.sum((other.left.T @ signal) ** 2))
            if key != candidate.key and key not in others and explained > ALIKE * float(signal @ signal):
                others.append(key)
        if self._ways(best):
            others.append((GAIN.cause, 1 - (candidate.joint or 0)))
        absorbed = np.linalg.lstsq(self._W, self._padded((candidate.white @ best.size)[:, None]))[0][:, 0]  # by parameters
        return Suspect(
            candidate.mistake.cause,
            candidate.mistake.of,
            candidate.joint,
            self._size_of(best),
            tuple(best.sigma.tolist()),
            candidate.mistake.unit,
            p,
            float(np.sqrt(best.chi2)),
            tuple(others),
            (0.0, 0.0) if candidate.mistake is COLLISION else errors,  # nothing predicts what happens once
            best.gain,
            candidate.mistake.setting,
            0.0,
            *self.rows.place(candidate.instant),
            gains=self._ways(best),
            explained=candidate.plain @ best.size - self._plain @ absorbed,
        )

    def _ways(self, best: _Tested) -> tuple[tuple[float, ...], ...]:
        """Both ways in which the ratio of two torques becomes right, where nothing sets their size; none of other mistakes."""
        candidate, n = best.candidate, self.problem.basis.n
        if candidate.mistake is not GAIN or n != 2 or self._gains.scaled:
            return ()
        factor, own = 1 + self._size_of(best)[0], np.arange(n) == candidate.joint
        return tuple(np.where(own, 1 / factor, 1.0).tolist()), tuple(np.where(own, 1.0, factor).tolist())

    def _size_of(self, best: _Tested) -> tuple[float, ...]:
        """Return the size of a mistake, iterated where that is large beside what its column is linear in."""
        mistake, joint = best.candidate.mistake, best.candidate.joint
        if mistake is GAIN:
            return (self._gains.of_one(joint or 0) - 1,)
        if (mistake.cause, mistake.of) == ("delay", "torque") and joint is not None:
            return (torque_lateness(self.problem, joint, float(best.size[0])),)
        return tuple(best.size.tolist())

    @cached_property
    def _plain(self) -> Array:
        return np.concatenate([part.rows.W for part in self.problem.parts])

    def _held_out(self, more: Sequence[Candidate]) -> Array:
        """Return the errors of each joint on stretches that were not fitted [% of its torque], shape (joint,)."""
        white = np.concatenate([self._W, *(self._padded(c.white) for c in more)], axis=1)
        plain = np.concatenate([self._plain, *(c.plain for c in more)], axis=1)
        return errors_of_stretches(self.problem, white, self._Y, plain)


def _scatter_of(tested: Sequence[_Tested]) -> float:
    """Return the variance of standardized tests, by the median of those of one column; at least 1, which it is of noise."""
    alone = [one.chi2 for one in tested if one.left.shape[1] == 1 and one.of_all]
    return max(1.0, float(np.median(alone)) / MEDIAN) if alone else 1.0
