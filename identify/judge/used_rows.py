"""Rows on which fits, torques and masks are judged: unmasked while joints move, the noise in them, and those up to 10 Hz."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Self

import numpy as np
import numpy.typing as npt

from idbench.identify.arrays import TINY, Array
from idbench.identify.data.motion_log import MotionLog
from idbench.identify.errors import LogError
from idbench.identify.estimators.leave_out import Stretches, left_out
from idbench.identify.estimators.problem import Problem
from idbench.identify.judge.residuals import Instants
from idbench.identify.models import ExplicitModel
from idbench.identify.noise.row_weights import two_levels
from idbench.identify.rows.chain import Chain
from idbench.identify.rows.operators import FirLowPass
from idbench.identify.rows.row_map import RowMap
from idbench.identify.rows.rows import manageable
from idbench.identify.signals.masks import AbstractMask, NoMask, ReversalMask, slow_speed
from idbench.identify.signals.prefilters import NoisePrefilter
from idbench.identify.signals.signals import Signals
from idbench.identify.signals.spectra import gain_of, welch

BAND = 10.0  # Frequency [Hz] up to which torques are judged: what drives and controllers of arms use of a model
OF_NYQUIST = 0.4  # Share of the Nyquist frequency above which no band goes: filters and differences need room


@dataclass(frozen=True, eq=False)
class UsedRows:
    """The explicit model's rows of one log, without a mask."""

    Y: Array
    """Torques, shape (instant, joint)."""
    W: Array
    """Columns, shape (instant, joint, p)."""
    moving: npt.NDArray[np.bool_]
    """Whether the joint moves, and its torque is logged, shape (instant, joint)."""
    time: Array
    """Of the rows [s], shape (instant,)."""
    band: float
    """Frequency up to which they go [Hz]."""

    @classmethod
    def of(cls, problem: Problem) -> list[Self]:
        """The rows of each log of a problem, of poses at rest all; none if a log is too short for this band."""
        try:
            return [cls._of_log(problem, log) for log in problem.logs]
        except LogError:
            return []

    @classmethod
    def _of_log(cls, problem: Problem, log: MotionLog) -> Self:
        chain, band = replace(problem.chain, mask=NoMask(), trim=None), min(BAND, OF_NYQUIST * log.fs / 2)
        if not log.poses:
            chain = replace(chain, prefilter=NoisePrefilter(3 * band, 0.0), operator=FirLowPass(band, band))
        signals = chain.signals(log)
        rows = chain.rows(signals, problem.basis, ExplicitModel())
        speed = np.abs(signals.state.qd)
        moving = (log.poses | (speed > slow_speed(signals.state.qd)[:, None]))[:, rows.maps[0].grid.samples].T
        moving[:, list(log.missing)] = False
        shape = (-1, rows.kinds)
        return cls(rows.Y.reshape(shape), rows.W.reshape(*shape, rows.W.shape[-1]), moving, rows.time[:: rows.kinds], band)

    def errors(self, X: Array) -> Array:
        """Torques less those predicted by X, of every instant or of all, shape (instant, joint); 0 where a joint rests."""
        return np.asarray(
            (self.Y - np.einsum("tjp,...tp->...tj", self.W, np.broadcast_to(X, self.W[:, 0].shape))) * self.moving
        )


def errors_left_out(problem: Problem, used: Sequence[UsedRows], stretches: Stretches) -> Array:
    """Sums of the absolute errors of each joint on used rows, those of each stretch predicted by a fit of the others, (joint,).

    By weighted least squares, whose weights are those of all rows.
    """
    parts = problem.explicit.parts
    weight = problem.explicit.factors.fit(2).weight
    rows = [part.rows.joined * np.tile(weight, part.rows.maps[0].grid.count)[:, None] for part in parts]
    X = left_out(stretches.products(parts, rows))
    return np.sum([np.sum(np.abs(one.errors(X[stretches.at(k, one.time)])), axis=0) for k, one in enumerate(used)], axis=0)


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


REACHES = (2.0, 4.0)
"""Wide masks that are compared with the short one, in multiples of the slow speed: up to a fifth of the rms speed. A KUKA
KR300 takes 4 in most joints; 1 was never best there, nor on UR10e, TX40 and Baxter."""

SHARE = 0.05
"""Share of a joint's mean absolute error that a wide mask must take to be chosen: it takes 10 to 55 % in five joints of a
KR300, at most 2 % on a UR10e, a TX40 and a Baxter."""


def suited_reach(problem: Problem) -> tuple[float, ...]:
    """Reach of the mask of each joint (`ReversalMask.reach`); empty where the short mask suits all.

    Near reversals the friction of joints with strong stiction is not Fs sign(qd), and rows there spoil the rest; on slow robots
    they are the most informative of all. Each mask is judged by predictions of stretches that were left out, on all rows of
    moving joints, where the written function is used: a wide mask must predict them better than the short one.
    Absolute errors count: no mask makes stiction itself predictable, and its squares would hide how well the rest is.
    """
    mask = problem.chain.mask
    if not isinstance(mask, ReversalMask) or mask.threshold is not None or problem.logs[0].poses:
        return ()
    logs = tuple(manageable(problem.logs))
    explicit = Problem(logs, problem.basis, ExplicitModel(), problem.chain) if problem.long else problem.explicit
    if not (used := UsedRows.of(explicit)):
        return ()
    stretches = Stretches.of(explicit.parts)
    best = errors_left_out(explicit, used, stretches)
    reach = np.zeros(problem.basis.n)
    for wide in REACHES:
        chain = replace(problem.chain, mask=replace(mask, reach=(wide,) * problem.basis.n))
        try:
            errors = errors_left_out(Problem(logs, problem.basis, ExplicitModel(), chain), used, stretches)
        except LogError:  # a short log has no room for wider edges
            break
        for j in range(problem.basis.n):
            if errors[j] < (1 - SHARE) * best[j]:
                best[j], reach[j] = errors[j], wide
    return tuple(reach.tolist()) if reach.any() else ()
