"""What an estimator is given."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Self, TypeVar
from weakref import ref

import numpy as np

from idbench.identify.arrays import Array
from idbench.identify.basis.basis import Basis
from idbench.identify.data.motion_log import MotionLog
from idbench.identify.errors import IdentificationError, LogError
from idbench.identify.estimators.log_rows import LogRows, Piece, bias_counts, pieces, require_logs
from idbench.identify.estimators.simulator import Simulation
from idbench.identify.models import AbstractModel, ExplicitModel
from idbench.identify.noise.propagation import NoiseLevels
from idbench.identify.noise.restricted_likelihood import least_level, likely, likely_levels, rms_torque
from idbench.identify.noise.row_weights import floor_of, reciprocal_root
from idbench.identify.noise.white_noise import count_noise, repeats, residual_level, torque_noise, white_noise
from idbench.identify.rows.chain import Chain
from idbench.identify.rows.factors import Factors, LeastSquaresFit, Prior, triangular
from idbench.identify.rows.rows import Rows, is_long
from idbench.identify.signals.signals import Signals

ROUNDING = 1e-9  # Share by which frequencies may differ that are the same: of a file they are the mean of its steps


Reduced = TypeVar("Reduced")

SAMPLED = 8  # Pieces of long logs from which noise is estimated and propagated
SURE = (
    2.0  # Times that residuals must allow the noise that differences show: a level from some hundred rows is known to a tenth
)
BEGIN, LEAST = (1.0, 0.1, 0.1), 1e-4  # Shares of the errors of rows of which one kind is not alike, to begin with, and at least


@dataclass(frozen=True, eq=False)
class Problem:
    """Logs, a robot and a model, and what follows from them; each is made when it is first asked for."""

    logs: tuple[MotionLog, ...]
    """What was logged: one log, or several of one fit. Leading axes are independent runs."""
    basis: Basis
    """The robot, linear in its parameters."""
    model: AbstractModel
    """Explicit, implicit, power, energy or integral."""
    chain: Chain
    """Signal processing, of all models; `own_chain` makes the rows of this one."""
    simulation: Simulation = Simulation()  # noqa: RUF009  # frozen
    """How the robot is simulated, for estimators that need it."""
    prior: Prior | None = None
    """What is known of the parameters before."""
    _signals: tuple[Signals, ...] = field(default=(), repr=False)
    _explicit: "Problem | None" = field(default=None, repr=False)

    def __post_init__(self) -> None:
        require_logs(self.logs)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the parameters X."""
        return self.basis.names

    @property
    def own_chain(self) -> Chain:
        """The chain with the operator of the model."""
        return self.chain.of_model(self.model)

    @cached_property
    def long(self) -> bool:
        """Whether the logs are too long for their rows to be kept."""
        return is_long(self.logs)

    def require_rows(self, who: str = "") -> None:
        """Raise IdentificationError, which begins with `who`, if the logs are too long for their rows to be kept."""
        if self.long:
            raise IdentificationError(
                f"{who}the rows of {sum(log.samples for log in self.logs)} samples of {self.basis.n} joints are too many to be "
                "kept: use an estimator that needs their triangular factors alone, such as WLS, or a part of the log"
            )

    @cached_property
    def rows(self) -> Rows:
        """Y, W and what belongs to them; raise IdentificationError if the logs are too long for their rows to be kept."""
        self.require_rows()
        return self.some_rows

    @cached_property
    def some_rows(self) -> Rows:
        """The rows of all parts."""
        return Rows.stack([part.rows for part in self.parts])

    @cached_property
    def signals(self) -> tuple[Signals, ...]:
        """Motion, torque and mask weights of each log; of long ones those of some pieces, evenly spread."""
        if self._signals:
            return self._signals
        if not self.long:
            return tuple(map(self.chain.signals, self.logs))
        every = self._pieces
        count = min(SAMPLED, len(every))
        some = [every[i * len(every) // count] for i in range(count)]
        return tuple(chain.signals(log.part(*piece)) for chain, log, piece in some)

    @cached_property
    def parts(self) -> tuple[LogRows, ...]:
        """The rows of each log, and what belongs to them; of long ones those of some pieces."""
        if self.explicit is self:
            return tuple(LogRows(ref(self), signals) for signals in self.signals)
        return tuple(LogRows(ref(self), part.signals, part) for part in self.explicit.parts)

    def every_part(self) -> Iterator[LogRows]:
        """Yield the rows of each log, or of every piece of long ones."""
        if self.long:
            yield from (LogRows(ref(self), chain.signals(log.part(*piece))) for chain, log, piece in self._pieces)
        else:
            yield from self.parts

    @cached_property
    def share(self) -> float:
        """The share of all rows that the parts make: 1 but for logs too long for their rows to be kept."""
        every = sum(self.own_chain.grid(log).count for log in self.logs)
        return len(self.some_rows.time) / self.some_rows.kinds / every

    @cached_property
    def position_noise(self) -> Array:
        """Noise of the positions [rad], shape (..., joint): from their differences, at least that of an encoder's count."""
        other = self.explicit
        return other.position_noise if other is not self else np.maximum(white_noise(self.signals, "q"), count_noise(self.logs))

    @cached_property
    def repeats(self) -> Array:
        """How many times that of independent errors the variance of averages of the positions is, shape (..., joint)."""
        return self.explicit.repeats if self.explicit is not self else repeats(self.logs, self.position_noise)

    @cached_property
    def factors(self) -> Factors:
        """Triangular factors of the rows as they are, one for each kind."""
        found = Factors.merged([part.rows.factors for part in self.every_part()]) if self.long else self.rows.factors
        return found.known(self.prior)

    @cached_property
    def scaled_factors(self) -> Factors:
        """Triangular factors of the rows, divided by what their noise is relative to that of others of their kind."""
        if self.alike:
            return self.factors
        if not self.long:
            return self.rows.factors_of(self.weights).known(self.prior)
        return Factors.merged(self._of_pieces(lambda part: part.rows.factors_of(part.weights))).known(self.prior)

    @cached_property
    def independent_factor(self) -> Array:
        """The triangular factor of the rows made independent, W without what noise adds to it, shape (..., p + 1, p + 1)."""
        if not self.long:
            return triangular(np.concatenate([part.whitening.whiten(part.unbiased.joined) for part in self.parts], axis=-2))
        biased = bias_counts(self.parts, self.names, self.share)

        def factor(part: LogRows) -> Array:
            return triangular(part.whitening.whiten((part.unbiased if biased else part.rows).joined))

        return triangular(np.concatenate(self._of_pieces(factor), axis=-2))

    @cached_property
    def weights(self) -> Array:
        """What rows are multiplied by, where those of one kind differ in their noise; else ones, shape (..., r) or (r,)."""
        if self.alike:
            return np.ones(len(self.some_rows.time))
        return np.concatenate([part.weights for part in self.parts], axis=-1)

    @property
    def explicit(self) -> "Problem":
        """The problem of the explicit model, whose rows show the noise of the logs."""
        return self if isinstance(self.model, ExplicitModel) else self._of_explicit

    @cached_property
    def _of_explicit(self) -> "Problem":
        return self._explicit or replace(self, model=ExplicitModel(), _signals=self.signals)

    @cached_property
    def start(self) -> LeastSquaresFit:
        """The estimate by weighted least squares, from all parts."""
        return self.some_rows.factors.known(self.prior).fit(2)

    @cached_property
    def noise(self) -> NoiseLevels:
        """The white noise of torques and positions, from their differences; it is what `Estimate.noise_sigma` contains."""
        if self.explicit is not self:
            return self.explicit.noise
        shown = torque_noise(self.signals)
        level = np.maximum(np.minimum(shown, self._allowed(shown)), self._resolution)
        return NoiseLevels(level, self.position_noise, self.repeats)

    def _allowed(self, shown: Array) -> Array:
        """The noise of the torques that residuals allow [N m], as far as it decides: `likely_noise` costs half a fit."""
        least = least_level(rms_torque([part.noisy for part in self.parts]), self._resolution)
        if (self._residual_level() <= least).all():
            return least
        of_positions = NoiseLevels(np.zeros_like(least), self.position_noise, self.repeats)
        return shown if (SURE * shown <= self._residual_level(of_positions)).all() else self.likely_noise.torque

    def _residual_level(self, others: NoiseLevels | None = None) -> Array:
        rows, noisy = zip(*((part.rows, part.noisy) for part in self.parts), strict=True)
        return residual_level(rows, noisy, self.some_rows.factors, self.start.X, others)

    @cached_property
    def likely_noise(self) -> NoiseLevels:
        """The noise by which rows are weighted: of torques what makes the explicit rows most likely (REML), model error too."""
        if self.explicit is not self:
            return self.explicit.likely_noise
        rows, noisy = zip(*((part.unbiased, part.noisy) for part in self.parts), strict=True)
        levels = NoiseLevels(self._residual_level(), self.position_noise, self.repeats)
        return likely_levels(rows, noisy, levels, self._resolution)

    @cached_property
    def _resolution(self) -> Array:
        """Standard deviation of the rounding of the torques [N m], shape (..., joint)."""
        return count_noise(self.logs, "tau")

    @cached_property
    def alike(self) -> bool:
        """Whether rows of one kind are alike in their noise, but for the mask: those of a model whose B is constant."""
        return all(part.rows.maps[0].alike for part in self.parts)

    @cached_property
    def floor(self) -> Array:
        """Variance that is added to that of every row where they are not alike, shape (...): see `floor_of`."""
        every = np.concatenate([part.variance for part in self.parts], axis=-1)
        rows, mean = self.some_rows, np.mean(every, axis=-1)
        left = rows.Y - rows.predicted(rows.factors_of(reciprocal_root(every, mean)).fit().X)
        return floor_of(left**2, every, rows.valid)

    @cached_property
    def shares(self) -> Array:
        """How much of each of their errors makes the rows most likely, shape (..., error): see `LogRows.errors`."""
        if self.alike:
            return np.ones((1,))
        units = [part.noisy.matrices(part.errors) for part in self.parts]
        joined = [part.unbiased.joined * part.noisy.kept[..., None] for part in self.parts]
        begin = np.broadcast_to(np.array(BEGIN), (*joined[0].shape[:-2], len(BEGIN)))
        return likely(units, joined, begin, np.full(len(BEGIN), LEAST))

    def at(self, log: MotionLog | Sequence[MotionLog]) -> Rows:
        """Return the rows of other logs, by the same chain, basis and model (instrumental variables, DIDIM).

        Instants are weighted as in the measured logs. A simulated motion reverses at slightly other instants: with a mask of
        its own, its rows would be of other stretches (with DIDIM, errors of 1.2 instead of 0.024 %).

        Raises
        ------
        LogError
            If the logs are not as many, as long, or of the same frequency and joints.
        IdentificationError
            If the logs are too long for their rows to be kept.
        """
        self.require_rows("rows at another log need those of this one, and ")
        logs = [log] if isinstance(log, MotionLog) else list(log)
        require_logs(logs)
        pairs = zip(logs, self.logs, strict=False)
        alike = (a.q.shape[-2:] == b.q.shape[-2:] and abs(a.fs / b.fs - 1) < ROUNDING for a, b in pairs)
        if len(logs) != len(self.logs) or not all(alike):
            raise LogError(
                "rows at other logs need one log for each of the problem's, of the same length, frequency and joints"
            )
        signals = (self.chain.signals(one, given) for one, given in zip(logs, self.signals, strict=True))
        return Rows.stack([self.rows_of(one) for one in signals])

    def with_model(self, model: AbstractModel) -> "Problem":
        """Return the problem of another model, which shares all that the two have in common."""
        of_explicit = isinstance(model, ExplicitModel)
        return self.explicit if of_explicit else replace(self, model=model, _signals=self.signals, _explicit=self.explicit)

    def with_basis(self, basis: Basis) -> Self:
        """Return the problem of another basis, such as one with other nonlinear parameters; signals are shared."""
        return replace(self, basis=basis, _signals=self.signals, _explicit=None)

    def with_logs(self, logs: Sequence[MotionLog]) -> Self:
        """Return the problem of other logs, such as those without wild samples."""
        return replace(self, logs=tuple(logs), _signals=(), _explicit=None)

    def forget(self) -> None:
        """Drop what only the rows of further models would need."""
        for part in self.explicit.parts:
            part.forget()

    def rows_of(self, signals: Signals) -> Rows:
        """Return the rows of the signals of one log, or of a piece of it."""
        return self.own_chain.rows(signals, self.basis, self.model)

    @cached_property
    def _pieces(self) -> list[Piece]:
        return pieces(self.own_chain, self.logs)

    def _of_pieces(self, reduced: Callable[[LogRows], Reduced]) -> list[Reduced]:
        """Reductions of every piece of long logs; the plain factors of their rows are made in passing."""
        plain, found = list[Factors](), list[Reduced]()
        for part in self.every_part():
            plain.append(part.rows.factors)
            found.append(reduced(part))
        self.__dict__.setdefault("factors", Factors.merged(plain).known(self.prior))
        return found
