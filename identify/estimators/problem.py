"""What an estimator is given."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Literal, Self

import numpy as np

from identify.arrays import Array
from identify.basis import Basis
from identify.data.motion_log import MotionLog
from identify.errors import IdentificationError, LogError
from identify.estimators.prepared import Prepared
from identify.estimators.variance_function import floor_of, reciprocal_root, rectified
from identify.models import AbstractModel
from identify.rows.chain import Chain
from identify.rows.factors import Factors
from identify.rows.noise_propagation import NoiseLevels, covariance, position_variance, smoothed, torque_variance
from identify.rows.pieces import is_long, pieces
from identify.rows.row_map import RowMap
from identify.rows.rows import Rows
from identify.signals.signals import Signals
from identify.signals.state import State

Weights = Literal["measured", "own"]

Influence = Callable[[Rows], Array]
"""Rows of a problem -> G, shape (..., rows, p), with which X = G' Y to first order."""


@dataclass(frozen=True, eq=False)
class Problem:
    """Logs, a robot and a model, and what follows from them; each is made when it is first asked for.

    Parameters
    ----------
    logs : tuple of MotionLog
        What was logged: one log, or several of one fit. Leading axes are independent runs.
    basis : Basis
        The robot, linear in its parameters.
    model : AbstractModel
        Explicit, implicit or power.
    chain : Chain
        Signal processing.
    simulate : callable, optional
        Returns the log of the robot with parameters X that repeats the motion (output error, DIDIM).
    prepared : Prepared, optional
        Signals and explicit rows, where other problems of the same logs have them already.
    """

    logs: tuple[MotionLog, ...]
    basis: Basis
    model: AbstractModel
    chain: Chain
    simulate: Callable[[Array], MotionLog] | None = None
    prepared: Prepared = field(default=None, repr=False)  # type: ignore[assignment]  # made right after

    def __post_init__(self) -> None:
        if not self.logs:
            raise LogError("there is no log to identify")
        if self.prepared is None:
            prepared = Prepared.of(self.logs, self.basis, self.chain, long=self.long)
            object.__setattr__(self, "prepared", prepared)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the parameters X."""
        return self.basis.names

    @cached_property
    def long(self) -> bool:
        """Whether the logs are too long for their rows to be kept."""
        return is_long(self.logs)

    def require_rows(self, who: str = "") -> None:
        """Raise IdentificationError, which begins with `who`, if the logs are too long for their rows to be kept."""
        if self.long:
            raise IdentificationError(
                f"{who}the rows of {sum(log.samples for log in self.logs)} samples of {self.basis.n} joints are too many to be "
                "kept: take an estimator that needs their triangular factors alone, such as WLS, or a part of the log"
            )

    @cached_property
    def rows(self) -> Rows:
        """Y, W and what belongs to them; raise IdentificationError if the logs are too long for their rows to be kept."""
        self.require_rows()
        return self.prepared.stacked(self.model)

    @property
    def signals(self) -> tuple[Signals, ...]:
        """Motion, torque and mask weights of each log; of long ones those of some pieces."""
        return self.prepared.signals

    @property
    def parts(self) -> tuple[Rows, ...]:
        """The rows of each log; of long ones those of some pieces."""
        return self.prepared.rows(self.model)

    @cached_property
    def factors(self) -> Factors:
        """Triangular factors of the rows as they are, one for each kind."""
        return self._factors[0]

    @cached_property
    def scaled_factors(self) -> Factors:
        """Triangular factors of the rows, divided by what their noise is relative to that of others of their kind."""
        return self._factors[1]

    @cached_property
    def _factors(self) -> tuple[Factors, Factors]:
        each = [(part.factors, self._scaled(part)) for part in self._all_parts()]
        plain, scaled = zip(*each, strict=True)
        return Factors.merged(plain), Factors.merged(scaled)

    def _all_parts(self) -> Iterator[Rows]:
        if not self.long:
            yield self.rows
            return
        for piece in pieces(self.chain, self.logs):
            yield self.chain.rows(self.chain.signals(piece), self.basis, self.model)

    def _scaled(self, rows: Rows) -> Factors:
        scale = self.row_scale(rows)
        return rows.factors if scale is None else rows.scaled_factors(scale)

    def row_scale(self, rows: Rows) -> Array | None:
        """Return what divides rows by their noise without a mask, shape (..., r); None if all of a kind are alike."""
        variance = self.row_variance(rows)
        return None if variance is None else reciprocal_root(variance, self.floor)

    @cached_property
    def floor(self) -> Array:
        """Variance that is added to that of every row, since not all residuals are noise, shape (...): see `floor_of`."""
        variances = [self._known_variance(part) for part in self.parts]
        mean = np.mean(np.concatenate(variances, axis=-1), axis=-1)
        scaled = zip(self.parts, variances, strict=True)
        X = Factors.merged([part.scaled_factors(reciprocal_root(x, mean)) for part, x in scaled]).fit().X
        squares = [(part.Y - part.predicted(X)) ** 2 for part in self.parts]
        return floor_of(np.concatenate(squares, axis=-1), np.concatenate(variances, axis=-1))

    def _known_variance(self, rows: Rows) -> Array:
        variance = self.row_variance(rows)
        return np.ones(rows.Y.shape) if variance is None else variance

    def row_variance(self, rows: Rows) -> Array | None:
        """Return the variance that the noise of the logs would give rows without a mask, shape (..., r).

        None where B is constant: the torque's noise is then the same in all rows of a joint. (What little M(q) changes the
        positions' noise from row to row is left out.)
        """
        if all(isinstance(B, float) for B in rows.maps[0].B.values()):
            return None
        return np.concatenate([self._variance(part) for part in rows.maps], axis=-1)

    def _variance(self, part: RowMap) -> Array:
        levels, linear = self.noise, self.prepared.linear(part.signals)
        variance = torque_variance(part, levels.torque, masked=False)
        variance = variance + position_variance(part, levels.position, linear, masked=False)
        variance = variance + self._at_rest(part) ** 2
        return np.swapaxes(variance, -1, -2).reshape(*variance.shape[:-2], -1)

    def _at_rest(self, part: RowMap) -> Array:
        """Return what noise of the velocities makes of the columns c where joints hardly move, shape (..., kind, count).

        Friction turns noise into power, Fs |qd|, of one sign: a bias, that of a velocity of E|qd + noise| - |qd|.
        """
        signals, X = part.signals, self.prepared.explicit_fit.X
        speed = rectified(smoothed(signals.state.qd, signals.fs), self.noise.position[..., None] * signals.gain)
        found = np.zeros(part.inside.shape)
        for (row, name), column in self.model.c(self.basis, State(signals.state.q, speed, signals.s)).items():
            found[..., row, :] += column * X[..., self.names.index(name), None]
        return part.kernel.apply(found)

    def excess(self, X: Array, weights: Callable[[Rows], Array]) -> Array:
        """Return how many times the squares of weighted residuals are what noise makes of them, at least 1, shape (...).

        1 where B is constant, since noise levels are those of such rows; elsewhere what the model does not explain counts, too.
        """
        squares, expected = np.zeros(()), np.zeros(())
        for part in self.parts if self.long else [self.rows]:
            variance = self.row_variance(part)
            if variance is None:
                return np.ones(X.shape[:-1])
            weight = weights(part) ** 2 * part.valid
            squares = squares + np.sum(weight * (part.Y - part.predicted(X)) ** 2, axis=-1)
            expected = expected + np.sum(weight * variance, axis=-1)
        free = 1 - len(self.names) / np.maximum(self.factors.together.rows * self.prepared.share, len(self.names) + 1)
        ratio = np.divide(squares, expected * free, out=np.ones_like(squares), where=expected > 0)
        return np.maximum(ratio, 1.0)

    @property
    def noise(self) -> NoiseLevels:
        """The noise of torques and positions, as the explicit model's rows show it."""
        return self.prepared.noise

    def noise_covariance(self, influence: Influence) -> Array:
        """Return the covariance that the noise of the logs gives an estimate X = G' Y, shape (..., p, p).

        Parameters
        ----------
        influence : callable
            Returns G, shape (..., rows, p), of rows of this problem.
        """
        total = np.zeros(())
        for part in self.parts if self.long else [self.rows]:
            G = influence(part)
            for k, rows in enumerate(part.maps):
                linear = self.prepared.linear(rows.signals)
                total = total + covariance(rows, G[..., part.of_log(k), :], self.noise, linear)
        return total / self.prepared.share

    def at(self, log: MotionLog | Sequence[MotionLog], weights: Weights = "measured") -> Rows:
        """Return the rows of other logs, by the same chain, basis and model (instrumental variables, DIDIM).

        Parameters
        ----------
        log : MotionLog or sequence of MotionLog
            One for each log of this problem, of the same length.
        weights : {"measured", "own"}
            Whether instants are weighted as in the measured logs, or by the mask of the other log.
        """
        self.require_rows("rows at another log need those of this one, and ")
        logs = [log] if isinstance(log, MotionLog) else list(log)
        if len(logs) != len(self.logs) or any(
            (a.q.shape, a.fs) != (b.q.shape, b.fs) for a, b in zip(logs, self.logs, strict=True)
        ):
            raise LogError(
                "rows at other logs need one log for each of the problem's, of the same length, frequency and joints"
            )
        if weights not in ("measured", "own"):
            raise IdentificationError(f"weights = {weights!r} is none of 'measured', 'own'")
        measured = self.prepared.signals if weights == "measured" else [None] * len(logs)
        signals = [self.chain.signals(one, given) for one, given in zip(logs, measured, strict=True)]
        return Rows.stack([self.chain.rows(one, self.basis, self.model) for one in signals])

    def with_model(self, model: AbstractModel) -> Self:
        """Return the problem of another model, which shares all that the two have in common."""
        return replace(self, model=model)

    def with_basis(self, basis: Basis) -> Self:
        """Return the problem of another basis, such as one with other nonlinear parameters; signals are shared."""
        return replace(self, basis=basis, prepared=self.prepared.with_basis(basis))
