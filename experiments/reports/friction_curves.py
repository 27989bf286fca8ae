"""Friction over velocity: as measured, and as the laws have it."""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from idbench.experiments.identification.fit import Fit
from idbench.identify import MODELS, Array, Basis, Chain, Instants, OfJoints, instants, noise_spectra
from idbench.identify.arrays import combined
from idbench.identify.basis import LoadFriction
from idbench.identify.basis.joint_law import AbstractFriction
from idbench.identify.basis.of_joints import block_of_all_joints
from idbench.identify.judge.residuals import filtered
from idbench.identify.rows.row_map import Kernel
from idbench.identify.signals.signals import Signals, State
from idbench.identify.signals.spectra import welch

RESOLUTION = 0.5  # Distance of the frequencies [Hz]


@dataclass(frozen=True)
class Spectrum:
    """Amplitude densities of a joint, or of a model that has no rows of joints."""

    row: str
    """Name of the joint, or of the model."""
    joint: int | None
    """Number of the joint, from 0; None for the only row of a model."""
    unit: str
    """Of the densities, times √Hz."""
    f: Array
    """Frequencies [Hz], without 0, shape (frequency,)."""
    lines: Mapping[str, Array]
    """Of what each model leaves, and of the noise of torques and of positions, shape (frequency,) each."""


def residual_instants(fit: Fit, forms: Iterable[str]) -> dict[str, Instants]:
    """Return the residuals of the equations of models, at every sample of the first log."""
    signals = fit.problem.signals[0]
    return {form: instants(signals, fit.basis, MODELS.create(form), fit.processing, fit.estimates[form].X) for form in forms}


def of_joints(fit: Fit, left: Mapping[str, Instants]) -> dict[str, Instants]:
    """Return the residuals of models whose rows are the torques of joints."""
    return {form: one for form, one in left.items() if fit.estimates[form].problem.alike}


def spectra(fit: Fit, left: Mapping[str, Instants]) -> Iterator[Spectrum]:
    """Yield the spectra of all joints, then those of models that have other rows; what is masked counts as like the rest."""
    alone = fit.on(0)
    fs = fit.logs.fitted[0].fs
    joined = of_joints(fit, left)
    noise: dict[str, Array] = {}
    for j, joint in enumerate(fit.robot_model.robot.joints) if joined else ():
        lines = {form: _density(one, j, fs) for form, one in joined.items()}
        f = next(iter(lines.values()))[0]
        if "explicit" in joined and not noise:
            each = noise_spectra(alone.problem, alone.estimates["explicit"].noise_levels, f)
            noise = dict(zip(("torque noise", "position noise"), each, strict=True))
        shown = {form: density for form, (_, density) in lines.items()} | {kind: each[j] for kind, each in noise.items()}
        yield Spectrum(joint, j, fit.robot_model.units(j)[0], f[1:], {name: density[1:] for name, density in shown.items()})
    for form in (form for form in left if form not in joined):
        f, density = _density(left[form], 0, fs)
        yield Spectrum(form, None, "W", f[1:], {form: density[1:]})


def _density(left: Instants, row: int, fs: float) -> tuple[Array, Array]:
    weight = left.weight[row]
    f, density = welch(left.residual[row] * weight, fs, min(left.residual.shape[-1], round(fs / RESOLUTION)))
    return f, np.sqrt(density / max(np.mean(weight**2), 1e-12))


FRICTIONS = ("viscous friction", "Coulomb friction", "friction", "shape of friction", "offset")
"""Kinds of parameters that make a friction law."""

WHOLE = 0.99  # Share of a row's weights from which on the mask takes nothing of it
BEYOND = 1.3  # Up to which multiple of the speeds of the log a law is drawn
POINTS = 201  # Of a curve to either side
LOADS = (0.05, 0.95)  # Quantiles of the load at which a law that grows with it is drawn


@dataclass(frozen=True, eq=False)
class FrictionCurves:
    """The friction of the joints of an identification."""

    fit: Fit
    """The identification."""
    X: Array
    """The parameters of one of its estimates, shape (p,)."""

    def rows(self, j: int) -> tuple[Array, Array, Array, Array]:
        """Return, of a joint, what its rows have, shape (row,) each.

        Velocities, the residual torque in the band of the fit, the torque less that of the rigid body, and the weights of the
        mask.
        """
        v, left, torque, weight = (np.concatenate(x) for x in zip(*((x[j] for x in part) for part in self._rows), strict=True))
        return v, left, torque, weight

    @cached_property
    def _rows(self) -> list[tuple[Array, Array, Array, Array]]:
        """What `rows` gives of all joints, log by log, shape (joint, row) each."""
        found, (laws, X) = [], self._laws
        for part in self.fit.problem.parts:
            rows, signals = part.rows, part.signals
            friction = combined(laws.explicit(signals.state), X, np.zeros(signals.state.q.shape))
            residual = rows.Y - rows.predicted(self.X)
            left = np.stack([residual[rows.group == j] for j in range(self.fit.basis.n)])
            qd, chain = filtered(signals, self.fit.processing)["qd"], self.fit.processing
            found.append((qd, left, left + _rows_of(signals, chain, friction), _rows_of(signals, chain, signals.weight)))
        return found

    def laws(self, j: int) -> Iterator[tuple[Array, Array]]:
        """Yield the law of a joint, with each of some loads where it depends on that: velocity [rad/s], friction [N m]."""
        v, *_, weight = self.rows(j)
        side = np.linspace(0, BEYOND * max(np.abs(v[weight > WHOLE]).max(initial=0.0), 1e-3), POINTS)[1:]
        v = np.concatenate([-side[::-1], [0.0], side])
        for load in self._loads(j):
            torque = self._at(j, v, load)
            torque[POINTS - 1] = np.nan  # where friction jumps
            yield v, torque

    def _at(self, j: int, v: Array, load: float) -> Array:
        """Return the law of a joint at velocities, in the middle of its positions, under a load."""
        laws, X = self._laws
        state = self.fit.problem.signals[0].state
        q = np.repeat(np.median(state.q, axis=-1)[:, None], len(v), axis=1)
        conditions = {name: np.repeat(np.median(x, axis=-1)[:, None], len(v), axis=1) for name, x in state.conditions.items()}
        moving = State(q, np.tile(v, (len(q), 1)), np.zeros_like, conditions)
        for block in laws.blocks:
            of_all = block_of_all_joints(block)
            made = _Loaded(load) if isinstance(of_all, LoadFriction) else of_all
            laws = laws.exchanged(block, replace(block, block=made) if isinstance(block, OfJoints) else made)
        return combined(laws.explicit(moving), X, np.zeros(q.shape))[j]

    def _loads(self, j: int) -> list[float]:
        """Return the loads at which a law of a joint is drawn: one, if it depends on none."""
        own = [block for block in self._laws[0].blocks if not isinstance(block, OfJoints) or j in block.joints]
        if (law := next((law for law in map(block_of_all_joints, own) if isinstance(law, LoadFriction)), None)) is None:
            return [0.0]
        return [float(x) for x in np.quantile(np.abs(law.load(self.fit.problem.signals[0].state)[j]), LOADS)]

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
        return self.load * np.sign(qd)


def _rows_of(signals: Signals, chain: Chain, x: Array) -> Array:
    """Return signals as the rows see them, shape (joint, row)."""
    response = chain.operator.response(signals.fs)
    return Kernel(response / response.sum(), (len(response) - 1) // 2, chain.grid(signals.log)).apply(x)
