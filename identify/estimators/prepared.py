"""What problems of the same logs, chain and robot have in common."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Self

from identify.basis import Basis
from identify.data.motion_log import MotionLog
from identify.estimators.noise_levels import noise_levels
from identify.models import AbstractModel, ExplicitModel
from identify.rows.chain import Chain
from identify.rows.factors import Factors, Fit
from identify.rows.noise_propagation import Linearization, NoiseLevels
from identify.rows.pieces import pieces, sampled
from identify.rows.rows import Rows
from identify.signals.signals import Signals


@dataclass(frozen=True, eq=False)
class Prepared:
    """Signals, rows of each model, and noise levels, each made when it is first asked for.

    Parameters
    ----------
    signals : tuple of Signals
        Of each log; of long ones those of some pieces.
    share : float
        Share of all rows that they make.
    basis : Basis
        The robot.
    chain : Chain
        Signal processing.
    """

    signals: tuple[Signals, ...]
    share: float
    basis: Basis
    chain: Chain
    _rows: dict[AbstractModel, tuple[Rows, ...]] = field(default_factory=dict, repr=False)
    _stacked: dict[AbstractModel, Rows] = field(default_factory=dict, repr=False)

    @classmethod
    def of(cls, logs: Sequence[MotionLog], basis: Basis, chain: Chain, *, long: bool) -> Self:
        """Return the signals of logs, of some pieces of them if they are long."""
        every = pieces(chain, logs) if long else logs
        some = sampled(every) if long else logs
        share = sum(log.samples for log in some) / sum(log.samples for log in every)
        return cls(tuple(map(chain.signals, some)), share, basis, chain)

    def rows(self, model: AbstractModel) -> tuple[Rows, ...]:
        """Return the rows of a model, log by log."""
        if model not in self._rows:
            self._rows[model] = tuple(self.chain.rows(signals, self.basis, model) for signals in self.signals)
        return self._rows[model]

    @cached_property
    def explicit_factors(self) -> Factors:
        """Triangular factors of the explicit model's rows."""
        return self.stacked(ExplicitModel()).factors

    def stacked(self, model: AbstractModel) -> Rows:
        """Return the rows of a model, those of all logs."""
        if model not in self._stacked:
            self._stacked[model] = Rows.stack(self.rows(model))
        return self._stacked[model]

    @cached_property
    def explicit_fit(self) -> Fit:
        """The explicit model's estimate by weighted least squares."""
        return self.explicit_factors.fit(2)

    @cached_property
    def noise(self) -> NoiseLevels:
        """The noise of torques and positions."""
        return noise_levels(self.rows(ExplicitModel()), self.explicit_factors, self.explicit_fit, self._linear)

    def linear(self, signals: Signals) -> Linearization:
        """Return the linearization of the explicit model about these signals."""
        known = {id(one): linear for one, linear in zip(self.signals, self._linear, strict=True)}
        return known.get(id(signals)) or Linearization(signals, self.basis, self.explicit_fit.X)

    @cached_property
    def _linear(self) -> tuple[Linearization, ...]:
        return tuple(Linearization(signals, self.basis, self.explicit_fit.X) for signals in self.signals)

    def with_basis(self, basis: Basis) -> Self:
        """Return this with another basis; signals are shared."""
        return replace(self, basis=basis, _rows={}, _stacked={})
