"""Looking into an identification: residuals at every sample, over the motion, and in frequency."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from idbench.identify.arrays import Array
from idbench.identify.basis.basis import Basis
from idbench.identify.data.motion_log import MotionLog
from idbench.identify.estimators.problem import Problem
from idbench.identify.models import AbstractModel, Equations
from idbench.identify.noise.propagation import NoiseLevels
from idbench.identify.rows.chain import Chain
from idbench.identify.rows.row_map import Kernel
from idbench.identify.signals.signals import Signals, State
from idbench.identify.signals.spectra import gain_of

EVERY = 50.0  # Frequency of the instants over which the robot's slopes are averaged [Hz]


def noise_spectra(problem: Problem, levels: NoiseLevels, f: Array) -> tuple[Array, Array]:
    """Return amplitude densities [N m/sqrt(Hz)] of torque and position noise in the torques, shape (joint, len(f)) each.

    White noise of a torque has the density sigma sqrt(2 / fs), before alignment and prefilter. That of positions is multiplied
    by inertia s^2 + damping s + stiffness, whose squares are averaged over the instants at which joints move.

    Parameters
    ----------
    problem : Problem
        Of one run of one log.
    levels : NoiseLevels
        Of its log.
    f : Array
        Frequencies of `welch` [Hz], from 0 to fs / 2.
    """
    signals = problem.signals[0]
    fs, some = signals.fs, slice(0, None, max(1, int(signals.fs / EVERY)))
    impulse = np.zeros(4 * int(np.ceil(problem.chain.halo(fs, signals.log.torque) * fs)) + 101)
    impulse[len(impulse) // 2] = 1.0
    of_each = np.eye(3)[..., None] * impulse  # in position, velocity and acceleration
    answers = signals.torque_adjoint(impulse), *(signals.position_adjoint((q, qd, qdd)) for q, qd, qdd in of_each)
    aligned, plain, rate, twice = (gain_of(h, round(fs / f[1])) for h in answers)
    moving = (signals.weight[:, None, some] > 0).astype(np.float64)
    inertia, damping, stiffness = problem.parts[0].linear.at(np.arange(signals.state.q.shape[-1], dtype=np.float64)[some])

    def mean(x: Array) -> Array:
        """Return the mean of x, shape (joint, joint, time), where joints move, times the squared noise of each position."""
        return np.sum(x * moving, axis=-1) / np.maximum(np.sum(moving, axis=-1), 1) @ levels.position**2

    parts = (
        (mean(stiffness**2), plain**2),
        (-2 * mean(stiffness * inertia), plain * twice),
        (mean(inertia**2), twice**2),
        (mean(damping**2), rate**2),
    )
    of_position = np.sqrt(np.maximum(sum(np.outer(of_joint, of_f) for of_joint, of_f in parts), 0.0))
    return np.sqrt(2 / fs) * levels.torque[:, None] * aligned, np.sqrt(2 / fs) * of_position


HALF = 0.5  # A filter's cut-off is where its gain has fallen to this share: -6 dB


@dataclass(frozen=True, eq=False)
class Instants:
    """What a model leaves unexplained before the operator."""

    equations: Equations
    """The model's."""
    everywhere: Array
    """B tau - (c + s e) X [N m], or [W], at all samples, shape (row, time)."""
    inner: slice
    """The samples between the first row and the last."""

    @property
    def first(self) -> int:
        """Number of the first of the inner samples."""
        return int(self.inner.start)

    @property
    def residual(self) -> Array:
        """Residuals at the inner samples, shape (row, time)."""
        return self.everywhere[..., self.inner]

    @property
    def weight(self) -> Array:
        """Weights of the mask there, shape (row, time)."""
        return self.equations.weight[..., self.inner]

    def in_rows(self, chain: Chain) -> Array:
        """Return the residuals of rows, Y - W X, of models without e, shape (r,); no column is made."""
        return chain.map(self.equations).measurement(self.everywhere)


def instants(signals: Signals, basis: Basis, model: AbstractModel, chain: Chain, X: Array) -> Instants:
    """Residual of `model` with the parameters `X` at every sample of one log.

    Raises
    ------
    LogError
        If the log does not fit the basis, or is too short for the chain.
    """
    grid, equations = chain.grid(signals.log), model.equations(basis, signals)
    inner = slice(grid.first, grid.first + grid.step * (grid.count - 1) + 1)
    return Instants(equations, equations.y - equations.predicted(X), inner)


def measured_state(log: MotionLog, chain: Chain) -> State:
    """Return positions as they were logged, and what the differentiator of the chain alone makes of them."""
    q = np.ascontiguousarray(np.swapaxes(log.q, -1, -2))

    def s(x: Array) -> Array:
        return chain.differentiator.derivative(x, log.fs)

    return State(q, s(q), s)


def filtered(signals: Signals, chain: Chain) -> dict[str, Array]:
    """Return q, qd and qdd of the rows, shape (joint, row): prefiltered, differentiated, and seen through the operator.

    The weights of the operator are divided by their sum, so that windows give means.
    """
    response = chain.operator.response(signals.fs)
    mean = Kernel(response / response.sum(), (len(response) - 1) // 2, chain.grid(signals.log))
    return {name: mean.apply(getattr(signals.state, name)) for name in ("q", "qd", "qdd")}


def binned(x: Array, y: Array, weight: Array, edges: Array) -> Array:
    """Return the weighted mean of `y` in each bin of `x`, NaN where there is none.

    Parameters
    ----------
    x, y, weight : Array, shape (time,)
        What is binned, averaged and weighted.
    edges : Array, shape (bins + 1,)
        Ends of the bins.
    """
    total, summed = (np.histogram(x, edges, weights=each)[0] for each in (weight, weight * y))
    return np.divide(summed, total, out=np.full(len(total), np.nan), where=total > 0)


def cutoffs(chain: Chain, fs: float) -> Mapping[str, float]:
    """Return the cut-offs [Hz] of prefilter and operator at -6 dB, as far as they have one below the Nyquist frequency.

    They are read from impulse responses, so that they hold for any filter.
    """
    reach = 1 + int(np.ceil(chain.prefilter.halo(fs) * fs))
    impulse = np.zeros(6 * reach + 101)
    impulse[len(impulse) // 2] = 1.0
    found = {"prefilter": chain.prefilter.apply(impulse, fs), "operator": chain.operator.response(fs)}
    each = {name: _cutoff(response, fs) for name, response in found.items()}
    return {name: f for name, f in each.items() if f is not None}


def _cutoff(response: Array, fs: float) -> float | None:
    size = 1 << int(np.ceil(np.log2(max(8192, 8 * len(response)))))
    gain = np.abs(np.fft.rfft(response, size))
    below = np.flatnonzero(gain < HALF * gain[0])
    return float(below[0] * fs / size) if len(below) else None
