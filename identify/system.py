"""The linear system Y = W X + rho."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import IntEnum
from functools import cached_property
from typing import Self

import numpy as np
import numpy.typing as npt

from identify.arrays import Array
from identify.carrier import Carrier
from identify.errors import ExcitationError, IdentificationError, LogError

UNSEEN = 1e-6
"""A direction of the parameters, in columns scaled to unit length, counts as unseen when its singular value is below this
share of the largest: it would take columns known to seven digits to tell it to 10 %, and no log gives those."""


class Status(IntEnum):
    """Whether a system can be solved for X."""

    OK = 0
    TOO_FEW_ROWS = 1
    RANK_DEFICIENT = 2


@dataclass(frozen=True, eq=False)
class System:
    """Y = W X + rho (Eq. 12): the rows that an operator has made of a model. Leading axes are independent runs.

    Parameters
    ----------
    Y : Array, shape (..., r)
        Measurement vector.
    W : Array, shape (..., r, p)
        Observation matrix.
    noise : Array, shape (..., r)
        How noisy a row is, relative to the other rows of its group; positive where the row is valid.
    valid : bool array, shape (..., r)
        False where a row is void (masked out); such rows of Y and W are zero.
    time : Array, shape (r,)
        Instant of every row [s].
    group : int array, shape (r,)
        Row of the model that a row comes from: the joint, from 0, or 0 for all rows of the power model.
    parameters : tuple of str
        Names of X.
    carriers : tuple of Carrier
        How the torques of each log reach the rows.
    levels : Array, shape (..., joint), optional
        Rms of the noise of each joint's torque [N m], where it is known (`identify.noise`).
    weight : Array, shape (..., r), optional
        What the rows have been multiplied by since the operator made them; ones if it is not given.
    stands_for : int array, shape (r,), optional
        How many rows each of the rows stands for, in a compressed system.
    """

    Y: Array
    W: Array
    noise: Array
    valid: npt.NDArray[np.bool_]
    time: Array
    group: npt.NDArray[np.intp]
    parameters: tuple[str, ...]
    carriers: tuple[Carrier, ...] = ()
    levels: Array | None = None
    weight: Array | None = None
    stands_for: npt.NDArray[np.intp] | None = None

    @cached_property
    def rows(self) -> npt.NDArray[np.intp]:
        """Number of rows that are not void, r, of every run."""
        return self.count(np.ones(len(self.group), dtype=bool))

    def count(self, which: npt.NDArray[np.bool_]) -> npt.NDArray[np.intp]:
        """Return how many rows of `which`, shape (r,), are not void, of every run."""
        return np.sum(self.valid * which * (1 if self.stands_for is None else self.stands_for), axis=-1)

    @cached_property
    def R(self) -> Array:
        """Triangular factor of [W Y], shape (..., p + 1, p + 1): all that least squares needs to know of the rows."""
        joined = np.concatenate([self.W, self.Y[..., None]], axis=-1)
        short = joined.shape[-1] - joined.shape[-2]
        if short > 0:
            joined = np.concatenate([joined, np.zeros((*joined.shape[:-2], short, joined.shape[-1]))], axis=-2)
        R: Array = np.linalg.qr(joined, mode="r")  # type: ignore[assignment]  # mode "r" gives R alone
        return R

    @property
    def R_W(self) -> Array:
        """Triangular factor of W, shape (..., p, p)."""
        p = len(self.parameters)
        return self.R[..., :p, :p]

    @cached_property
    def condition_number(self) -> Array:
        """Cond(W), the ratio of its extreme singular values, shape (...)."""
        values = self._singular_values[..., 0, :]
        return np.divide(values[..., 0], values[..., -1], out=np.full(values.shape[:-1], np.inf), where=values[..., -1] > 0)

    @cached_property
    def rank(self) -> npt.NDArray[np.intp]:
        """Numerical rank of W with its columns scaled to unit length, shape (...)."""
        values = self._singular_values[..., 1, :]
        return np.count_nonzero(values > UNSEEN * values[..., :1], axis=-1)

    @cached_property
    def status(self) -> npt.NDArray[np.intp]:
        """Status of every run, shape (...)."""
        p = len(self.parameters)
        deficient = np.where(self.rank < p, Status.RANK_DEFICIENT, Status.OK)
        return np.where(self.rows <= p, Status.TOO_FEW_ROWS, deficient)

    def unseen(self, run: tuple[int, ...] = ()) -> tuple[str, ...]:
        """Return the parameters of `run` that the motion does not show, alone or in some combination."""
        _, values, directions = np.linalg.svd(self._scaled[run])
        null = directions[values <= UNSEEN * values.max()]
        share = np.abs(null).max(axis=0, initial=0.0)
        return tuple(name for name, s in zip(self.parameters, share, strict=True) if s > 1e-3)

    def hidden(self, run: tuple[int, ...] = ()) -> tuple[str, ...]:
        """Return parameters of `run` without which W has full rank: of each combination that is not shown the last in order."""
        W, left = self._scaled[run], list(range(len(self.parameters)))
        while left:
            _, values, directions = np.linalg.svd(W[:, left])
            if values[-1] > UNSEEN * values[0]:
                break
            share = np.abs(directions[-1])
            left.pop(int(np.flatnonzero(share > 0.1 * share.max())[-1]))
        return tuple(name for k, name in enumerate(self.parameters) if k not in left)

    def check(self) -> None:
        """Raise unless every run can be solved.

        Raises
        ------
        IdentificationError
            If there are no more rows than parameters.
        ExcitationError
            If the motion does not show every parameter; the message names those it does not show.
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
        """Return why a run whose status is not OK cannot be solved, and what to do."""
        p = len(self.parameters)
        if self.status[run] == Status.TOO_FEW_ROWS:
            return (
                f"{self.rows[run]} rows of {self.valid.shape[-1]} are left by the mask for {p} parameters: use a longer "
                "motion, in which every joint moves; in the power model all must move at once"
            )
        if self.rows[run] < 2 * p:
            rows = f"{self.rows[run]} rows for {p} parameters tell {self.rank[run]} of them"
            return f"{rows}: use a longer log, in which all joints move"
        return (
            f"the motion does not show {', '.join(self.unseen(run))}: W has rank {self.rank[run]} of {p}; "
            "move every joint, with others standing and moving, or leave these parameters out of the basis"
        )

    @cached_property
    def _singular_values(self) -> Array:
        """Singular values of W as it is, and with its columns scaled to unit length, shape (..., 2, p)."""
        return np.linalg.svd(np.stack([self.R_W, self._scaled], axis=-3), compute_uv=False)

    @property
    def _scaled(self) -> Array:
        """Triangular factor of W with its columns scaled to unit length, shape (..., p, p)."""
        length = np.linalg.norm(self.R_W, axis=-2, keepdims=True)
        return self.R_W / np.where(length > 0, length, 1.0)

    @classmethod
    def stack(cls, systems: Sequence[Self]) -> Self:
        """Return the rows of several logs as one system: the paper's independent realizations."""
        if not systems:
            raise LogError("there is no log to identify")
        first = systems[0]
        if any(s.parameters != first.parameters or s.Y.shape[:-1] != first.Y.shape[:-1] for s in systems):
            raise LogError("the logs of one fit must have the same parameters and the same number of runs")
        return cls(
            Y=np.concatenate([s.Y for s in systems], axis=-1),
            W=np.concatenate([s.W for s in systems], axis=-2),
            noise=np.concatenate([s.noise for s in systems], axis=-1),
            valid=np.concatenate([s.valid for s in systems], axis=-1),
            time=np.concatenate([s.time for s in systems]),
            stands_for=None
            if all(s.stands_for is None for s in systems)
            else np.concatenate([np.ones(len(s.group), int) if s.stands_for is None else s.stands_for for s in systems]),
            group=np.concatenate([s.group for s in systems]),
            parameters=first.parameters,
            carriers=tuple(carrier for s in systems for carrier in s.carriers),
        )

    def weighted(self, weight: Array) -> Self:
        """Return this system with its rows multiplied by `weight`, shape (..., r)."""
        return replace(
            self,
            Y=self.Y * weight,
            W=self.W * weight[..., None],
            noise=self.noise * weight,
            weight=weight if self.weight is None else self.weight * weight,
        )
