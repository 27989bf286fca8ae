"""Triangular factors: all that least squares needs to know of rows, however many there are."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from enum import IntEnum
from functools import cached_property
from typing import NamedTuple, Self, TypeAlias

import numpy as np
import numpy.typing as npt

from idbench.identify.arrays import TINY, Array
from idbench.identify.errors import ExcitationError, IdentificationError

NOT_SHOWN = 1e-6
"""Singular value, over the largest, of columns scaled to unit length, below which no log has a direction to seven digits."""

NOISE = 1e-3
"""Share of the measurements that counts as noise at least beside what is known before: rows as few as parameters show none."""


Prior: TypeAlias = Callable[[Array], Array]
"""What is known of parameters before any log: R of rows in units of their noise -> [P, P x0], P (x - x0) of variance 1, shape
(m, p + 1)."""


class Status(IntEnum):
    """Whether rows can be solved for X."""

    OK = 0
    TOO_FEW_ROWS = 1
    RANK_DEFICIENT = 2


@dataclass(frozen=True, eq=False)
class Factor:
    """The triangular factor R of [W Y], which has the least-squares solutions of all rows. Leading axes are runs."""

    R: Array
    """Q R = [W Y], shape (..., p + 1, p + 1)."""
    rows: npt.NDArray[np.intp]
    """Number of rows that are not void, r, shape (...)."""
    names: tuple[str, ...]
    """Names of X."""
    prior: Array | None = None
    """What is known before: rows in the unit of those of R, shape (..., m, p + 1), optional."""
    noise: Array | None = None
    """Standard deviation of noise in that unit, shape (...), where something is known before."""

    @property
    def p(self) -> int:
        """Number of parameters."""
        return len(self.names)

    @property
    def R_W(self) -> Array:
        """Triangular factor of W, shape (..., p, p)."""
        return self.R[..., : self.p, : self.p]

    @cached_property
    def whole(self) -> Array:
        """The factor of the rows and of what is known before, shape (..., p + 1, p + 1)."""
        return self.R if self.prior is None else triangular(np.concatenate([self.R, self.prior], axis=-2))

    @cached_property
    def condition_number(self) -> Array:
        """Cond(W), the ratio of its extreme singular values, shape (...)."""
        values = self._singular_values[..., 0, :]
        return np.divide(values[..., 0], values[..., -1], out=np.full(values.shape[:-1], np.inf), where=values[..., -1] > 0)

    @cached_property
    def rank(self) -> npt.NDArray[np.intp]:
        """Numerical rank of W with its columns scaled to unit length, shape (...)."""
        values = self._singular_values[..., 1, :]
        return np.count_nonzero(values > NOT_SHOWN * values[..., :1], axis=-1)

    @property
    def determined(self) -> npt.NDArray[np.bool_]:
        """Whether W has full rank, and nothing in it is lost, shape (...)."""
        finite = np.asarray(np.isfinite(self.R).all(axis=(-2, -1)))
        return finite & (Factor(np.where(finite[..., None, None], self.whole, 0.0), self.rows, self.names).rank == self.p)

    @cached_property
    def status(self) -> npt.NDArray[np.intp]:
        """Status of every run, shape (...)."""
        deficient = np.where(self.rank < self.p, Status.RANK_DEFICIENT, Status.OK)
        known = 0 if self.prior is None else self.prior.shape[-2]
        return np.where(self.rows + known <= self.p, Status.TOO_FEW_ROWS, deficient)

    def solution(self, solvable: npt.NDArray[np.bool_]) -> Array:
        """Return the least-squares solution X, shape (..., p); NaN in runs that are not `solvable`, shape (...)."""
        R = np.where(solvable[..., None, None], self.whole[..., : self.p, : self.p], np.eye(self.p))
        X = np.linalg.solve(R, self.whole[..., : self.p, self.p :])[..., 0]
        return np.where(solvable[..., None], X, np.nan)

    def inverse(self, solvable: npt.NDArray[np.bool_]) -> Array:
        """Return (W' W + P' P)^-1, shape (..., p, p); NaN in runs that are not `solvable`, shape (...)."""
        root = np.linalg.inv(np.where(solvable[..., None, None], self.whole[..., : self.p, : self.p], np.eye(self.p)))
        return np.where(solvable[..., None, None], np.matmul(root, np.swapaxes(root, -1, -2)), np.nan)

    def squares(self, X: Array) -> Array:
        """Return |Y - W X|^2, shape (...)."""
        rest = self.R[..., -1] - np.matmul(self.R[..., :-1], X[..., None])[..., 0]
        return np.sum(rest**2, axis=-1)

    def not_shown(self, run: tuple[int, ...] = ()) -> tuple[str, ...]:
        """Return the parameters of `run` that the motion does not excite, alone or in some combination."""
        _, values, directions = np.linalg.svd(self._scaled[run])
        null = directions[values <= NOT_SHOWN * values.max()]
        share = np.abs(null).max(axis=0, initial=0.0)
        return tuple(name for name, s in zip(self.names, share, strict=True) if s > 1e-3)

    def hidden(self, run: tuple[int, ...] = ()) -> tuple[str, ...]:
        """Return parameters of `run` without which W has full rank: of each combination that is not shown the last in order."""
        W, left = self._scaled[run], list(range(self.p))
        while left:
            _, values, directions = np.linalg.svd(W[:, left])
            if values[-1] > NOT_SHOWN * values[0]:
                break
            share = np.abs(directions[-1])
            left.pop(int(np.flatnonzero(share > 0.1 * share.max())[-1]))
        return tuple(name for k, name in enumerate(self.names) if k not in left)

    def check(self) -> None:
        """Raise unless every run can be solved.

        Raises
        ------
        IdentificationError
            If there are no more rows than parameters.
        ExcitationError
            If the motion does not excite every parameter; the message names those it does not show.
        """
        failed = np.argwhere(self.status != Status.OK)
        if not len(failed):
            return
        run = tuple(int(i) for i in failed[0])
        where = f" (run {run}, and {len(failed) - 1} more)" if run else ""
        if self.status[run] == Status.TOO_FEW_ROWS:
            raise IdentificationError(self.explain(run) + where)
        raise ExcitationError(self.explain(run) + where, self.hidden(run))

    def explain(self, run: tuple[int, ...] = ()) -> str:
        """Reason why a run whose status is not OK cannot be solved, and the way out."""
        if self.status[run] == Status.TOO_FEW_ROWS:
            return (
                f"{self.rows[run]} rows are left by the mask for {self.p} parameters: use a longer motion, in which every "
                "joint moves; in the power model all must move at once"
            )
        if self.rows[run] < 2 * self.p:
            rows = f"{self.rows[run]} rows for {self.p} parameters identify {self.rank[run]} of them"
            return f"{rows}: use a longer log, in which all joints move"
        return (
            f"the motion does not excite {', '.join(self.not_shown(run))}: W has rank {self.rank[run]} of {self.p}; "
            "move every joint, with the others at rest and moving, or leave these parameters out of the basis"
        )

    @cached_property
    def _singular_values(self) -> Array:
        """Singular values of W as it is, and with its columns scaled to unit length, shape (..., 2, p)."""
        return np.linalg.svd(np.stack([self.R_W, self._scaled], axis=-3), compute_uv=False)

    @property
    def _scaled(self) -> Array:
        """Triangular factor of W, and of what is known, with its columns scaled to unit length, shape (..., p, p)."""
        R = self.whole[..., : self.p, : self.p]
        length = np.linalg.norm(R, axis=-2, keepdims=True)
        return R / np.where(length > 0, length, 1.0)


class LeastSquaresFit(NamedTuple):
    """A weighted least-squares solution."""

    X: Array
    """Parameters, shape (..., p); NaN in runs that cannot be solved."""

    weight: Array
    """What the rows of every kind were multiplied by, shape (..., kind)."""

    factor: Factor
    """The factor of the weighted rows."""


CONVERGED = 4
"""Rounds after which weights converge: of an iiwa's last joint, 0.15 mN m, two leave 5.8 % of the torque, three 2.1 %."""


@dataclass(frozen=True, eq=False)
class Factors:
    """Triangular factors of [W Y], one for each kind of row: joints, or the one kind of the power model."""

    R: Array
    """The factors, shape (..., kind, p + 1, p + 1)."""
    rows: npt.NDArray[np.intp]
    """Numbers of rows that are not void, shape (..., kind)."""
    names: tuple[str, ...]
    """Names of X."""
    prior: Prior | None = None
    """What is known before."""
    _fits: list[LeastSquaresFit] = field(default_factory=list, repr=False)

    def __post_init__(self) -> None:
        for values in (self.R, self.rows):
            values.setflags(write=False)

    @classmethod
    def merged(cls, parts: Sequence[Self]) -> Self:
        """Return the factors of the rows of all parts together."""
        if len(parts) == 1:
            return parts[0]
        R = triangular(np.concatenate([part.R for part in parts], axis=-2))
        return cls(R, np.sum([part.rows for part in parts], axis=0), parts[0].names)

    def known(self, prior: Prior | None) -> Self:
        """Return the factors with something that is known before."""
        return self if prior is None else replace(self, prior=prior, _fits=[])

    def only(self, places: Sequence[int], known: Mapping[int, Array | float] | None = None) -> Self:
        """Return the factors of rows with the parameters at some places; of others those `known`, shape (...), count in Y."""
        R = self.R.copy()
        for place, value in (known or {}).items():
            R[..., -1] -= np.asarray(value)[..., None, None] * R[..., place]
        return type(self)(triangular(R[..., [*places, -1]]), self.rows, tuple(self.names[place] for place in places))

    @cached_property
    def together(self) -> Factor:
        """The factor of all rows as they are."""
        plain = self.weighted(np.ones(self.rows.shape))
        measured = np.sqrt(np.sum(plain.R[..., -1] ** 2, axis=-1) / np.maximum(plain.rows, 1))
        left = np.abs(plain.R[..., -1, -1]) / np.sqrt(np.maximum(plain.rows - plain.p, 1))
        return self._with_prior(plain, np.maximum(left, NOISE * measured))

    def weighted(self, weight: Array) -> Factor:
        """Return the factor of all rows, those of each kind multiplied by its weight, shape (..., kind)."""
        if weight.shape[-1] == 1:
            return Factor(self.R[..., 0, :, :] * weight[..., None], self.rows[..., 0], self.names)
        stacked = (self.R * weight[..., None, None]).reshape(*self.R.shape[:-3], -1, self.R.shape[-1])
        return Factor(triangular(stacked), np.sum(self.rows, axis=-1), self.names)

    def squares(self, X: Array) -> Array:
        """Return |Y - W X|^2 of every kind, shape (..., kind)."""
        return Factor(self.R, self.rows, self.names).squares(X[..., None, :])

    def misfit(self, counts: npt.NDArray[np.intp] | None = None) -> Array:
        """Return minus twice the log-likelihood, shape (...), as of `counts` rows, shape (..., kind); inf if unsolved."""
        each = np.log(np.maximum(self.squares(self.fit(CONVERGED).X) / np.maximum(self.rows, 1), TINY))
        found = np.sum((self.rows if counts is None else counts) * each, axis=-1)
        return np.where(np.isnan(found), np.inf, found)

    def fit(self, rounds: int = 0) -> LeastSquaresFit:
        """Return the least-squares solution, with rows divided by the rms of their kind's residuals after the first step.

        X(k+1) = argmin sum over kinds |Y - W X|^2 / rms(Y - W X(k))^2 for k < `rounds`.
        """
        if not self._fits:
            one = np.ones(self.rows.shape)
            self._fits.append(LeastSquaresFit(self.together.solution(self.together.status == Status.OK), one, self.together))
        while len(self._fits) <= rounds:
            weight = 1 / self._rms(self._fits[-1].X)
            factor = self._with_prior(self.weighted(weight), np.ones(self.rows.shape[:-1]))
            self._fits.append(LeastSquaresFit(factor.solution(self.together.status == Status.OK), weight, factor))
        return self._fits[rounds]

    def _with_prior(self, factor: Factor, sigma: Array) -> Factor:
        """Return the factor of rows whose noise has the standard deviation `sigma`, shape (...), with what is known before."""
        return factor if self.prior is None else replace(factor, prior=prior_rows(self.prior, factor.R, sigma), noise=sigma)

    def _rms(self, X: Array) -> Array:
        """Return the rms of every kind's residuals, shape (..., kind), at least 1e-12 of the measurements; 1 without any."""
        level = np.sqrt(self.squares(X) / np.maximum(self.rows, 1))
        mean = np.sum(self.R[..., -1] ** 2, axis=(-2, -1)) / np.maximum(np.sum(self.rows, axis=-1), 1)
        floor = np.where(mean > 0, 1e-12 * np.sqrt(mean), 1.0)[..., None]
        return np.where(np.isfinite(level), np.maximum(level, floor), 1.0)


def prior_rows(prior: Prior, R: Array, sigma: Array) -> Array:
    """Return the rows of a prior beside those of R whose noise is `sigma`, run by run, shape (..., m, p + 1)."""
    found = [s * prior(r / s) for r, s in zip(R.reshape(-1, *R.shape[-2:]), np.maximum(sigma.ravel(), TINY), strict=True)]
    return np.reshape(found, (*R.shape[:-2], *found[0].shape))


def triangular(joined: Array) -> Array:
    """Return R of Q R = `joined`, shape (..., rows, q), as a square matrix, padded with zeros where rows are few."""
    short = joined.shape[-1] - joined.shape[-2]
    if short > 0:
        joined = np.concatenate([joined, np.zeros((*joined.shape[:-2], short, joined.shape[-1]))], axis=-2)
    R: Array = np.linalg.qr(joined, mode="r")  # type: ignore[assignment]  # mode "r" gives R alone
    return R
