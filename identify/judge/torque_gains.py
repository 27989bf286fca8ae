"""Gains of all torques at once: which are too large beside the others, as inertias that several joints feel show."""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Self

import numpy as np
import numpy.typing as npt

from idbench.identify.arrays import HELD, TINY, Array
from idbench.identify.data.motion_log import never_logged
from idbench.identify.estimators.problem import Problem
from idbench.identify.judge.stretches import held_torque, variance_of_sums
from idbench.identify.signals.signals import State

ROUNDS, SETTLED = 60, 1e-7  # Gauss-Newton steps at most, and the change of the misfit, for each joint, that ends them
KNOWN = 0.1
"""Standard deviation of ln |a| above which a log says nothing of a gain: torques of a joint that others hardly feel."""

SAME = 4.0  # Gains agree that differ by at most so many sigma
NEAR = 0.02  # ... or by this share: no torque constant is known to a fiftieth
DECISIVE = 40.0
"""What a mistake takes of minus twice the logarithm of the likelihood at least: with rows that are correlated over ten of their
steps, four sigma of independent ones."""

NOTHING = 1e-10  # Share of the largest eigenvalue of the normal equations below which a direction is not known
STATES = 100  # Of a log, at which inertias are looked at


@dataclass(frozen=True, eq=False)
class TorqueGains:
    """Logged torques with a gain each, tau_j = a_j (W_j X + h_j) + e_j, at the X and a that make them most likely.

    Multiplied by one number, all a, and X divided by it, explain the same: where nothing is held, their ratios are known.
    """

    problem: Problem
    """The explicit model, whose rows are kept."""
    factors: Array
    """Triangular factors of [W_j, h_j, tau_j] of each joint, shape (joint, p + 2, p + 2)."""
    counts: npt.NDArray[np.intp]
    """Rows of each joint that has a torque, shape (joint,)."""
    free: npt.NDArray[np.bool_]
    """Which gains are free, shape (joint,)."""
    start: Array
    """Those of the others, and where these begin, shape (joint,)."""

    @classmethod
    def of(cls, problem: Problem) -> Self:
        """Gains of all torques that change, beside the explicit model of a problem whose rows are kept."""
        rows, held = problem.rows, held_torque(problem.parts)
        whole = np.column_stack([rows.W, held, rows.Y + held]) * rows.valid[:, None]
        p, n = whole.shape[1], problem.basis.n
        factors = np.zeros((n, p, p))
        for j in range(n):
            R = np.linalg.qr(whole[rows.group == j], mode="r")
            factors[j, : len(R)] = R
        driven = (factors[:, :, -1] != 0).any(axis=1) & ~np.isin(np.arange(n), never_logged(problem.logs))
        return cls(problem, factors, rows.count * driven, driven, np.ones(n))  # nothing has a size where there is no torque

    @property
    def n(self) -> int:
        """Number of joints."""
        return len(self.counts)

    @cached_property
    def scaled(self) -> bool:
        """Whether something that is held sets the scale of all."""
        return bool(np.any(self.factors[:, :, -2]))

    @cached_property
    def fitted(self) -> tuple[Array, Array]:
        """X, shape (p,), and a, shape (joint,), from which a Gauss-Newton step takes nothing more of the misfit."""
        begins = [self.start, self._odd_one, *([] if self.scaled else [self._homogeneous])]
        return min(map(self._settled, begins), key=lambda found: self._misfit(*found))

    @property
    def misfit(self) -> float:
        """Minus twice the logarithm of the likelihood, but for a constant: sum over joints of N_j ln |e_j|^2."""
        return self._misfit(*self.fitted)

    def choices(self) -> list[Array]:
        """By what each torque is too large, in the ways in which as few are as may be; none if the log shows none.

        Several where it cannot tell them apart. Where nothing sets the scale, that of most joints is right.
        """
        X, a = self.fitted
        size, C, each = np.log(np.maximum(np.abs(a), TINY)), self._covariance, np.arange(self.n)
        if self.scaled:
            sigma, side = np.sqrt(np.maximum(np.diagonal(C), 0.0)), 1.0
            known = self.free & (sigma <= KNOWN)
            groups = [tuple(each[np.abs(size) <= np.maximum(SAME * sigma, NEAR)])]
        else:
            side = float(np.sign(np.sum(np.sign(mean_inertias(self.problem, X)))) or 1.0)
            apart = np.sqrt(np.maximum(np.diagonal(C)[:, None] + np.diagonal(C) - 2 * C, 0.0))
            agree = np.abs(size[:, None] - size) <= np.maximum(SAME * apart, NEAR)
            known = ((apart <= KNOWN) & self.free & self.free[:, None] & (each[:, None] != each)).any(axis=0)
            every = sorted({tuple(each[agree[j] & known]) for j in each[known]})
            groups = [group for group in every if len(group) == max(map(len, every))]
        found = [self._without(np.isin(each, group) | ~known, np.where(known & (side * a < 0), -1.0, 1.0)) for group in groups]
        if self.scaled:  # what agrees is one factor of all, as of a unit
            found = [_alike(factors, sigma) for factors in found]
        return [factors for factors in found if (factors != 1).any()]

    def of_one(self, j: int) -> float:
        """By what the torque of one joint is too large if those of all others are right."""
        return float(replace(self, free=np.arange(self.n) == j).fitted[1][j])

    def _without(self, right: npt.NDArray[np.bool_], signs: Array) -> Array:
        """By what each torque is too large if that of some is right, but for its sign; those are, too, that explain little."""
        made = replace(self, free=self.free & ~right, start=signs)
        for j in np.flatnonzero(made.free):
            fewer = replace(made, free=made.free & (np.arange(self.n) != j))
            if fewer.misfit - made.misfit < DECISIVE:
                made = fewer
        return made.fitted[1]

    @cached_property
    def hidden(self) -> Array:
        """Error of each torque's gain up to which the log would not show it, if only that were wrong, shape (joint,); or inf.

            sqrt(DECISIVE) sigma,   1 / sigma^2 = c' (I - W W^+) c / r,   c_j = W_j X + h_j over the rms of the residual

        with r how many times that of white ones the variance of sums of residuals is.
        """
        a = np.ones(self.n)
        X = self._least_squares(a, 1 / np.maximum(np.linalg.norm(self.factors[:, :, -1], axis=1), TINY))
        X = self._least_squares(a, self._weights(X, a))
        A = self._linear(X, a, self._weights(X, a))[0]
        W, c = A[:, : len(X)], A[:, len(X) :]
        left = c - W @ np.linalg.lstsq(W, c)[0]
        known, size = np.sum(left**2, axis=0) / self._spread(X, a), np.sum(c**2, axis=0)
        shown = known > NOTHING * np.maximum(size, TINY)
        return np.sqrt(np.divide(DECISIVE, known, out=np.full(self.n, np.inf), where=shown & (known > 0)))

    @cached_property
    def _covariance(self) -> Array:
        """Covariance of ln |a| with residuals as correlated as they are, shape (joint, joint); large where nothing is known."""
        X, a = self.fitted
        A = self._linear(X, a, self._weights(X, a))[0]
        A[:, len(X) :] *= a
        size = np.linalg.norm(A, axis=0)
        size[size <= TINY] = 1.0
        A = (A / size).reshape(self.n, -1, A.shape[1])
        each = np.matmul(np.swapaxes(A, 1, 2), A)
        values, axes = np.linalg.eigh(each.sum(axis=0))
        inverse = (axes / np.maximum(values, NOTHING * values[-1])) @ axes.T
        spread = np.einsum("j,jkl->kl", self._spread(X, a), each)
        C = inverse @ spread @ inverse / np.outer(size, size)
        return np.asarray(C[len(X) :, len(X) :])

    def _spread(self, X: Array, a: Array) -> Array:
        """How many times that of white ones the variance of sums of the residuals is, shape (joint,)."""
        rows, held = self.problem.rows, held_torque(self.problem.parts)
        rest = rows.Y + held - a[rows.group] * (rows.predicted(X) + held)
        to_rows = rows.maps[0]
        return variance_of_sums(rows.by_kind(rest * rows.valid), to_rows.grid.step / to_rows.signals.fs)

    def _misfit(self, X: Array, a: Array) -> float:
        return float(np.sum(self.counts * np.log(np.maximum(self._squares(X, a), TINY))))

    def _squares(self, X: Array, a: Array) -> Array:
        return np.sum((self.factors[:, :, -1] - a[:, None] * self._predicted(X)) ** 2, axis=1)

    def _predicted(self, X: Array) -> Array:
        return np.asarray(self.factors[:, :, :-2] @ X + self.factors[:, :, -2])

    def _least_squares(self, a: Array, weight: Array) -> Array:
        """X for gains a, with a weight of each joint."""
        scale = (a * weight)[:, None, None]
        A = (self.factors[:, :, :-2] * scale).reshape(-1, self.factors.shape[-1] - 2)
        y = (self.factors[:, :, -1] - a[:, None] * self.factors[:, :, -2]) * weight[:, None]
        return np.asarray(np.linalg.lstsq(A, y.ravel())[0])

    def _weights(self, X: Array, a: Array) -> Array:
        return np.asarray(np.sqrt(self.counts / np.maximum(self._squares(X, a), TINY)))

    def _settled(self, a: Array) -> tuple[Array, Array]:
        level = np.linalg.norm(self.factors[:, :, -1], axis=1)
        X = self._least_squares(a, 1 / np.maximum(level, TINY))
        misfit = self._misfit(X, a)
        for _ in range(ROUNDS):
            weight = self._weights(X, a)
            X = self._least_squares(a, weight)
            dX, da = np.split(np.linalg.lstsq(*self._linear(X, a, weight))[0], [len(X)])
            share, after = 1.0, np.inf
            while share > SETTLED and not (after := self._misfit(X + share * dX, a + share * da)) <= misfit:
                share /= 2
            if not after < misfit - SETTLED * len(self.counts):
                break
            X, a, misfit = X + share * dX, np.where(self.free, a + share * da, a), after
        return X, a

    def _linear(self, X: Array, a: Array, weight: Array) -> tuple[Array, Array]:
        """Rows of the step [dX, da], each joint's times its weight: its residual, and the slopes of what is predicted."""
        predicted, m = self._predicted(X), self.factors.shape[1]
        slopes = np.zeros((self.n, m, len(X) + self.n))
        slopes[:, :, : len(X)] = a[:, None, None] * self.factors[:, :, :-2]
        each = np.arange(self.n)
        slopes[each, :, len(X) + each] = np.where(self.free[:, None], predicted, 0.0)
        rest = self.factors[:, :, -1] - a[:, None] * predicted
        return (slopes * weight[:, None, None]).reshape(-1, len(X) + self.n), (rest * weight[:, None]).ravel()

    @property
    def _odd_one(self) -> Array:
        """Gains of which one is not as it begins: that of the joint for which the others then are explained best."""
        level = 1 / np.maximum(np.linalg.norm(self.factors[:, :, -1], axis=1), TINY)
        best, found = np.inf, self.start
        for j in np.flatnonzero(self.free):
            X = self._least_squares(self.start, np.where(np.arange(self.n) == j, 0.0, level))
            predicted, a = self._predicted(X)[j], self.start.copy()
            a[j] = predicted @ self.factors[j, :, -1] / max(float(predicted @ predicted), TINY)
            if a[j] and (misfit := self._misfit(X, a)) < best:
                best, found = misfit, a
        return found

    @property
    def _homogeneous(self) -> Array:
        """Gains by the combination of W_j and tau_j that comes nearest to nothing, with columns of unit length."""
        level = np.maximum(np.linalg.norm(self.factors[:, :, -1], axis=1), TINY)
        W = self.factors[:, :, :-2] / level[:, None, None]
        tau = np.zeros((self.n, W.shape[1], self.n))
        each = np.arange(self.n)
        tau[each, :, each] = -self.factors[:, :, -1] / level[:, None]
        A = np.concatenate([W, tau], axis=-1).reshape(-1, W.shape[-1] + self.n)
        size = np.maximum(np.linalg.norm(A, axis=0), TINY)
        g = (np.linalg.svd(A / size, full_matrices=False)[2][-1] / size)[W.shape[-1] :]
        a = np.divide(1.0, g, out=np.ones(self.n), where=np.abs(g) > TINY)
        return np.asarray(np.where(self.free, a / np.median(np.abs(a)), self.start))


def _alike(factors: Array, sigma: Array) -> Array:
    """Factors as one, the mean of their logarithms by their weights, where they agree within their standard deviations."""
    wrong = factors != 1
    if not wrong.any() or (factors <= 0).any():
        return factors
    size, weight = np.log(factors[wrong]), 1 / np.maximum(sigma[wrong], TINY) ** 2
    mean = float(size @ weight / weight.sum())
    return np.where(wrong, np.exp(mean), factors) if (np.abs(size - mean) <= SAME * sigma[wrong]).all() else factors


def mean_inertias(problem: Problem, X: Array, C: Array | None = None) -> Array:
    """Mean inertia of each joint along the first log, M_jj = c X with c of a unit velocity, shape (joint,).

    Over its sigma, where the covariance C of X is given; 0 where a joint has none.
    """
    basis, state = problem.basis, problem.signals[0].state
    some = slice(None, None, max(1, state.q.shape[-1] // STATES))
    q, conditions = np.ascontiguousarray(state.q[..., some]), {name: x[..., some] for name, x in state.conditions.items()}
    found = np.zeros(basis.n)
    for j in range(basis.n):
        unit = np.zeros_like(q)
        unit[j] = 1.0
        columns = basis.momentum(State(q, unit, lambda _: np.zeros_like(q), conditions))
        c, held = np.zeros(len(X)), 0.0
        for (row, place), column in columns.items():
            if row == j and place == HELD:
                held += float(np.mean(column))
            elif row == j:
                c[place] += float(np.mean(column))
        variance = 1.0 if C is None else float(c @ C @ c)
        found[j] = (c @ X + held) / np.sqrt(variance) if variance > 0 else 0.0
    return found
