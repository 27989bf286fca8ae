"""The rows on which a fit is judged, and the noise in them."""

from dataclasses import dataclass, replace

import numpy as np

from idbench.identify.arrays import TINY, Array
from idbench.identify.estimators.problem import Problem
from idbench.identify.judge.residuals import Instants
from idbench.identify.models import ExplicitModel
from idbench.identify.noise.row_weights import two_levels
from idbench.identify.rows.chain import Chain
from idbench.identify.rows.row_map import RowMap
from idbench.identify.signals.masks import AbstractMask, NoMask, ReversalMask
from idbench.identify.signals.signals import Signals
from idbench.identify.signals.spectra import gain_of, welch

FEW = 0.1  # Share of the sum of an operator's weights, by size, that their sum must be for rows to say what a constant becomes


def as_judged(problem: Problem) -> Problem:
    """Return a problem by the explicit model whose mask leaves reversals out as it does where no speed is given."""
    mask = problem.chain.mask
    if isinstance(mask, NoMask):
        usual: AbstractMask = _WhereItMoves()
    elif isinstance(mask, ReversalMask) and mask.threshold is not None:
        usual = replace(mask, threshold=None)
    else:
        return problem.with_model(ExplicitModel())
    return Problem(problem.logs, problem.basis, ExplicitModel(), replace(problem.chain, mask=usual))


def shares(rows: RowMap) -> Array:
    """Return the share of a constant that the mask leaves in each row, shape (..., kind, count); 1 where nothing is masked."""
    whole = rows.kernel.apply(np.ones_like(rows.inside))
    if np.abs(whole).min(initial=np.inf) < FEW * np.abs(rows.response).sum():  # the operator leaves nothing of a constant
        return rows.outside
    return np.asarray(rows.outside * rows.kernel.apply(rows.inside) / whole)


@dataclass(frozen=True)
class _WhereItMoves(AbstractMask):
    """Leaves out where joints reverse or rest, except those that rest all the time."""

    mask: ReversalMask = ReversalMask()  # noqa: RUF009  # frozen

    def halo(self, fs: float) -> float:
        return self.mask.halo(fs)

    def weight(self, qd: Array, fs: float) -> Array:
        weight = self.mask.weight(qd, fs)
        return np.where((weight == 0).all(axis=-1, keepdims=True), 1.0, weight)


RESOLUTION = 0.5  # Distance of the frequencies that are looked at [Hz]
QUIET = 0.02  # Gain of the operator, as a share of that at rest, below which a frequency is above its band
MIN_FREQUENCIES = 8  # Frequencies above the band that it takes to distinguish two kinds of noise
FAINT = 1e-2  # Relative power below which a frequency is ignored: above a prefilter, what masks let through exceeds noise


def row_noise(left: Instants, signals: Signals, chain: Chain) -> Array:
    """Return the rms of the noise in the rows of the explicit model, joint by joint [N m], shape (joint,).

    The residual above the band of the operator is noise, S(f) = a |A(f)|^2 + b |D(f)|^2: of the torque, white
    before alignment and prefilter (A), and of the position, white before prefilter and two differentiations (D), a and b fitted
    with errors in proportion to S. The rows have what of S passes the operator.

    Parameters
    ----------
    left : Instants
        Residuals of the explicit model for one run; what it does not explain of the motion lies inside the band.
    signals : Signals
        Of the same log.
    chain : Chain
        Signal processing.

    Returns
    -------
    Array
        NaN where too little lies above the band: sampling is slow, or the operator is no low-pass.
    """
    fs = signals.fs
    length = min(left.residual.shape[-1], round(fs / RESOLUTION))
    f, S = welch(left.residual * left.weight, fs, length)
    S = S / np.maximum(np.mean(left.weight**2, axis=-1, keepdims=True), TINY)
    passed = gain_of(chain.operator.response(fs), length)
    kinds = np.stack([gain_of(impulse, length) ** 2 for impulse in _impulses(signals, chain)])
    above = (passed < QUIET * passed[0]) & (f > f[np.argmax(passed < QUIET * passed[0])]) & (f < 0.95 * fs / 2)
    above &= (kinds > FAINT * kinds.max(axis=1, keepdims=True)).any(axis=0)
    if np.count_nonzero(above) < MIN_FREQUENCIES:
        return np.full(len(S), np.nan)
    levels = np.stack(two_levels(kinds[0, above], kinds[1, above], S[:, above]), axis=-1)
    return np.sqrt(np.trapezoid(levels @ kinds * passed**2, f, axis=-1))


def _impulses(signals: Signals, chain: Chain) -> tuple[Array, Array]:
    """Impulse responses of the torque's residual to torque and to position."""
    log, fs = signals.log, signals.fs
    x = np.zeros(2 * int(np.ceil(chain.halo(fs, log.torque) * fs)) + 101)
    x[len(x) // 2] = 1.0
    x = signals.prefilter.apply(x, fs)
    position = chain.differentiator.derivative(chain.differentiator.derivative(x, fs), fs)
    return chain.alignment.align(x[None], replace(log.torque, lags=()), fs).mean[0], position
