"""Friction over velocity: as measured, and as the laws have it."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from idbench.experiments.identification.fit import Fit
from idbench.identify import AbstractBlock, Array, Basis, Chain, OfJoints
from idbench.identify.arrays import combined
from idbench.identify.basis import LoadFriction
from idbench.identify.basis.joint_law import AbstractFriction
from idbench.identify.basis.of_joints import inner_of
from idbench.identify.judge.diagnosis import filtered
from idbench.identify.rows.grid import Kernel
from idbench.identify.signals.signals import Signals
from idbench.identify.signals.state import State

FRICTIONS = ("viscous friction", "Coulomb friction", "friction", "shape of friction", "offset")
"""Kinds of parameters that make a friction law."""

WHOLE = 0.99
"""Share of a row's weights from which on the mask takes nothing of it."""

BEYOND = 1.3
"""Up to which multiple of the speeds of the log a law is drawn."""

POINTS = 201
"""Of a curve to either side."""

LOADS = (0.05, 0.95)
"""Quantiles of the load at which a law that grows with it is drawn."""


@dataclass(frozen=True)
class Curve:
    """A law over velocity."""

    v: Array
    """Velocity [rad/s], shape (point,)."""
    torque: Array
    """Friction [N m], shape (point,)."""


@dataclass(frozen=True, eq=False)
class FrictionCurves:
    """The friction of the joints of an identification."""

    fit: Fit
    """The identification."""
    X: Array
    """The parameters of one of its estimates, shape (p,)."""

    def measured(self, j: int) -> tuple[Array, Array, Array]:
        """Return velocities of a joint, its torque less the rigid body's, and the weights of the mask, shape (row,) each."""
        v, left, law, weight = self._joined(j)
        return v, left + law, weight

    def residual(self, j: int) -> tuple[Array, Array, Array]:
        """Return velocities of a joint, the residual torque in the band of the fit, and the weights, shape (row,) each."""
        v, left, _, weight = self._joined(j)
        return v, left, weight

    def _joined(self, j: int) -> tuple[Array, Array, Array, Array]:
        v, left, law, weight = (np.concatenate(x) for x in zip(*((x[j] for x in part) for part in self._rows), strict=True))
        return v, left, law, weight

    @cached_property
    def _rows(self) -> list[tuple[Array, Array, Array, Array]]:
        """Velocity, residual, law and weight of all joints, log by log, shape (joint, row) each."""
        found, (laws, X) = [], self._laws
        for part in self.fit.problem.parts:
            rows, signals = part.rows, part.signals
            friction = combined(laws.explicit(signals.state), X, np.zeros(signals.state.q.shape))
            residual = rows.Y - rows.predicted(self.X)
            left = np.stack([residual[rows.group == j] for j in range(self.fit.basis.n)])
            qd, chain = filtered(signals, self.fit.processing)["qd"], self.fit.processing
            found.append((qd, left, _rows_of(signals, chain, friction), _rows_of(signals, chain, signals.weight)))
        return found

    def laws(self, j: int) -> Iterator[Curve]:
        """Yield the law of a joint over velocity, with each of some loads where it depends on that."""
        v, _, weight = self.measured(j)
        fastest = BEYOND * max(np.abs(v[weight > WHOLE]).max(initial=0.0), 1e-3)
        side = np.linspace(0, fastest, POINTS)[1:]
        v = np.concatenate([-side[::-1], [0.0], side])
        for load in self._loads(j):
            torque = self._at(j, v, load)
            torque[POINTS - 1] = np.nan  # where friction jumps
            yield Curve(v, torque)

    def _at(self, j: int, v: Array, load: float) -> Array:
        """Return the law of a joint at velocities, in the middle of its positions, under a load."""
        laws, X = self._laws
        state = self.fit.problem.signals[0].state
        q = np.repeat(np.median(state.q, axis=-1)[:, None], len(v), axis=1)
        conditions = {name: np.repeat(np.median(x, axis=-1)[:, None], len(v), axis=1) for name, x in state.conditions.items()}
        moving = State(q, np.tile(v, (len(q), 1)), np.zeros_like, conditions)
        for block in laws.blocks:
            laws = laws.exchanged(block, _loaded(block, load))
        return combined(laws.explicit(moving), X, np.zeros(q.shape))[j]

    def _loads(self, j: int) -> list[float]:
        """Return the loads at which a law of a joint is drawn: one, if it depends on none."""
        own = [inner_of(block) for block in self._laws[0].blocks if not isinstance(block, OfJoints) or j in block.joints]
        law = next((block for block in own if isinstance(block, LoadFriction)), None)
        if law is None:
            return [0.0]
        load = np.abs(law.load(self.fit.problem.signals[0].state)[j])
        return [float(x) for x in np.quantile(load, LOADS)]

    @cached_property
    def _laws(self) -> tuple[Basis, Array]:
        """The laws of friction of the joints, and their parameters."""
        basis = self.fit.basis
        laws = basis.of([p for p in basis.parameters if p.kind in FRICTIONS and p.joint is not None])
        return laws, self.X[[basis.places[parameter] for parameter in laws.parameters]]


@dataclass(frozen=True)
class _Loaded(AbstractFriction):
    """Friction under a load that does not change."""

    load: float
    symbol = "Fl"
    unit = "1"

    def force(self, q: Array, qd: Array) -> Array:
        del q
        return self.load * np.sign(qd)


def _loaded(block: AbstractBlock, load: float) -> AbstractBlock:
    """Return a block whose load is a given one."""
    made = _Loaded(load) if isinstance(inner_of(block), LoadFriction) else inner_of(block)
    return replace(block, block=made) if isinstance(block, OfJoints) else made


def _rows_of(signals: Signals, chain: Chain, x: Array) -> Array:
    """Return signals as the rows see them, shape (joint, row)."""
    response = chain.operator.response(signals.fs)
    return Kernel(response / response.sum(), (len(response) - 1) // 2, chain.grid(signals.log)).apply(x)
