"""The rows of one log, and what belongs to them."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from idbench.identify.arrays import Array
from idbench.identify.data.motion_log import MotionLog, TorqueChannel
from idbench.identify.errors import LogError
from idbench.identify.models import torque_rows
from idbench.identify.noise.covariance import BandedCovariance, Whitening
from idbench.identify.noise.linearization import Linearization
from idbench.identify.noise.propagation import NoisyRows
from idbench.identify.noise.row_weights import friction_bias, reciprocal_root, unbiased, with_more_noise
from idbench.identify.rows.chain import Chain
from idbench.identify.rows.factors import Factor, triangular
from idbench.identify.rows.rows import Rows
from idbench.identify.signals.signals import Signals

if TYPE_CHECKING:
    from weakref import ref

    from idbench.identify.estimators.problem import Problem


DELAY_STEP = 1e-4  # Half the difference of delays [s]: small beside a sample, large beside the rounding of an interpolation


def require_logs(logs: Sequence[object]) -> None:
    """Raise LogError unless all are logs, of which there is one at least."""
    if not logs:
        raise LogError("there is no log to identify")
    for log in logs:
        if not isinstance(log, MotionLog):
            raise LogError(f"{log!r:.60} is given where a MotionLog is needed, such as read_log(path)")


@dataclass(frozen=True, eq=False)
class LogRows:
    """The rows of one log, or of a piece of it, and what its noise makes of them; each is made when it is first asked for."""

    owner: "ref[Problem]"
    """Robot, model and chain, and the noise of all logs. Weak, since the problem has these rows: a circle of references would
    keep what is large until the garbage is collected."""
    signals: Signals
    """Of the log."""
    explicit: "LogRows | None" = None
    """Those of the explicit model from the same signals, where this is another model: what noise does to both is shared."""

    @property
    def problem(self) -> "Problem":
        """The problem, which must be kept as long as its rows are used."""
        problem = self.owner()
        assert problem is not None
        return problem

    @cached_property
    def rows(self) -> Rows:
        """Y = W X + rho."""
        return self.problem.rows_of(self.signals)

    @cached_property
    def linear(self) -> Linearization:
        """The linearization of the explicit model about the signals."""
        if self.explicit is not None:
            return self.explicit.linear
        return Linearization(self.signals, self.problem.basis, self.problem.explicit.start.X)

    @cached_property
    def noisy(self) -> NoisyRows:
        """How noise of the log reaches the rows."""
        return self._twin.noisy if self._twin else NoisyRows(self.rows.maps[0], self.linear)

    @cached_property
    def covariance(self) -> BandedCovariance:
        """The covariance of the rows by `Problem.noise`."""
        return self._twin.covariance if self._twin else self.noisy.covariance(self.problem.noise)

    @property
    def likely_covariance(self) -> BandedCovariance:
        """The covariance of the rows by `Problem.likely_noise`."""
        return self._twin.likely_covariance if self._twin else self.noisy.covariance(self.problem.likely_noise)

    @cached_property
    def whitening(self) -> Whitening:
        """What makes the rows independent, by `Problem.likely_noise` and, of a model such as power, its `errors`."""
        if self._twin:
            return self._twin.whitening
        if self.problem.alike:
            found = self.noisy.whitening(self.problem.likely_noise)
            self.noisy.forget()
            return found
        shares, errors = self.problem.shares, self.errors
        del self.__dict__["errors"]  # what is large, and needed by nothing else
        return self.noisy.whitening_by(errors, shares)

    @cached_property
    def errors(self) -> list[BandedCovariance]:
        """Where B varies, what noise makes of the rows, and errors of that mean variance: white, and of friction near zero."""
        C = self.likely_covariance
        mean, (count, kinds) = np.mean(C.variance, axis=-1, keepdims=True), C.bands.shape[-3:-1]
        of_rest = np.mean(rest := self.bias**2, axis=-1, keepdims=True)
        share = np.divide(rest, of_rest, out=np.ones_like(rest), where=of_rest > 0)
        return [C, *(BandedCovariance.of_variance(mean * x, kinds) for x in (np.ones(count * kinds), share))]

    @cached_property
    def unbiased(self) -> Rows:
        """The rows with W less what noise of the positions adds to it on average."""
        return unbiased(self.rows, self.problem.rows_of(self.noisier))

    @cached_property
    def noisier(self) -> Signals:
        """The signals with more noise, which all models share."""
        return with_more_noise(self.signals, self.problem.position_noise) if self.explicit is None else self.explicit.noisier

    def delay_slopes(self, each: bool) -> list[Array]:
        """Return the derivatives of Y by the delay of all torques, or of each, by central differences, shape (..., r) [1/s]."""
        to_rows, log = self.rows.maps[0], self.signals.log

        def measured(tau: Array, change: float) -> Array:
            torque = replace(log.torque, delay=log.torque.delay + change)
            moved = replace(self.signals, log=replace(log, tau=tau, torque=torque))
            return to_rows.measurement(torque_rows(to_rows.B, moved))

        parts = [log.tau * of_joint for of_joint in np.eye(log.n)] if each else [log.tau]
        return [(measured(tau, DELAY_STEP) - measured(tau, -DELAY_STEP)) / (2 * DELAY_STEP) for tau in parts]

    @cached_property
    def bias(self) -> Array:
        """What noise of the velocities makes of W X where joints hardly move, shape (..., r)."""
        return self._bias_of(self.noisy)

    @cached_property
    def variance(self) -> Array:
        """The variance that the noise of the logs would give the rows without a mask, shape (..., r)."""
        whole = self.noisy.unmasked
        return whole.variance(self.problem.noise) + self._bias_of(whole) ** 2

    def forget(self) -> None:
        """Drop what only the rows of further models would need."""
        self.__dict__.pop("noisier", None)

    @property
    def weights(self) -> Array:
        """What rows of a model whose B varies are multiplied by, shape (..., r)."""
        return reciprocal_root(self.variance, self.problem.floor)

    @cached_property
    def _twin(self) -> "LogRows | None":
        """The rows of the explicit model, if noise reaches both alike."""
        other = self.explicit
        return other if other is not None and self.rows.maps[0].noisy_as(other.rows.maps[0]) else None

    def _bias_of(self, noisy: NoisyRows) -> Array:
        return friction_bias(noisy.to_rows, self.linear, self.problem.model, self.problem.noise.position)


def split_by_log(x: Array, parts: Sequence[LogRows], axis: int = 0) -> list[Array]:
    """Values of the rows of all parts, one after the other along an axis, part by part."""
    return np.split(x, np.cumsum([len(part.rows.time) for part in parts])[:-1], axis)


def noise_covariance(problem: "Problem", influence: Sequence[Array]) -> Array:
    """Covariance that the noise of a problem's logs gives an estimate X = G' Y, shape (..., p, p).

    G of each of its parts has shape (..., r, p).
    """
    each = zip(problem.parts, influence, strict=True)
    return sum((part.covariance.of_sums(G) for part, G in each), start=np.zeros(())) / problem.share


def bias_covariance(problem: "Problem", influence: Sequence[Array]) -> Array:
    """Return the square of the bias that noise of velocities near zero gives an estimate X = G' Y, shape (..., p, p)."""
    if problem.alike:
        return np.zeros(())
    each = zip(problem.parts, influence, strict=True)
    bias = sum((np.matmul(np.swapaxes(G, -1, -2), part.bias[..., None]) for part, G in each), start=np.zeros(()))
    return np.matmul(bias, np.swapaxes(bias, -1, -2)) / problem.share**2


def delay_covariance(parts: Sequence[LogRows], influence: Sequence[Array]) -> Array:
    """Return the covariance of the error of X due to that of the delays, shape (..., p, p).

    With X = G' Y and a delay that is off by d, X is off by G' (dY/d delay) d: logs with the same channel together.
    """
    slopes: dict[tuple[TorqueChannel, int], Array] = {}
    for part, G in zip(parts, influence, strict=True):
        channel = part.signals.log.torque
        each, sigma = isinstance(channel.delay_sigma, tuple), np.atleast_1d(channel.delay_sigma)
        for j, slope in enumerate(part.delay_slopes(each)):
            slopes[channel, j] = slopes.get((channel, j), 0.0) + np.sum(G * slope[..., None], axis=-2) * sigma[j]
    return np.asarray(sum(slope[..., :, None] * slope[..., None, :] for slope in slopes.values()))


MOVED = 0.02  # Sigma by which what noise adds to W may move an estimate of long logs for it to be left there

Piece = tuple[Chain, MotionLog, tuple[int, int]]
"""A chain, a log, first sample and end of a piece of it."""


def pieces(chain: Chain, logs: Sequence[MotionLog]) -> list[Piece]:
    """Return every piece of logs, each with the chain whose prefilter and mask are suited to the whole log."""
    found = list[Piece]()
    for log in logs:
        signals = chain.signals(log)  # of which nothing but what suits the log is kept
        own = replace(chain, prefilter=signals.prefilter, mask=chain.mask.suited(signals.state.qd))
        found += [(own, log, piece) for piece in own.pieces(log)]
    return found


def bias_counts(parts: Sequence[LogRows], names: tuple[str, ...], share: float) -> bool:
    """True if the errors-in-variables bias exceeds `MOVED` sigma of all rows, of which `parts` are a share."""
    plain, better = (
        Factor(triangular(np.concatenate(rows)), np.array(0), names)
        for rows in (
            [part.whitening.whiten(part.rows.joined) for part in parts],
            [part.whitening.whiten(part.unbiased.joined) for part in parts],
        )
    )
    known = np.array(plain.determined & better.determined)
    sigma = np.sqrt(np.diagonal(better.inverse(known)) * share)
    return not (np.abs(plain.solution(known) - better.solution(known)) < MOVED * sigma).all()
