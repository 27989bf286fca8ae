"""Whether the residuals of a fit depend on the motion: a test of lack of fit, joint by joint."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import final

import numpy as np
import scipy

from idbench.identify.arrays import Array
from idbench.identify.data.motion_log import MotionLog
from idbench.identify.errors import IdentificationError
from idbench.identify.estimators.log_rows import LogRows
from idbench.identify.estimators.problem import Problem
from idbench.identify.judge.diagnosis import Instants
from idbench.identify.models import ExplicitModel
from idbench.identify.noise.row_weights import two_levels
from idbench.identify.rows.chain import Chain
from idbench.identify.rows.row_map import RowMap
from idbench.identify.rows.rows import Rows
from idbench.identify.signals.masks import AbstractMask, NoMask, ReversalMask
from idbench.identify.signals.signals import Signals

FEW = 0.1
"""Share of the sum of an operator's weights, by size, that their sum must be for rows to say what a constant becomes."""


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
    ones = np.ones_like(rows.inside)
    whole = rows.kernel.apply(ones)
    if np.abs(whole).min(initial=np.inf) < FEW * np.abs(rows.response).sum():  # the operator leaves nothing of a constant
        return rows.outside
    return np.asarray(rows.outside * rows.kernel.apply(rows.inside) / whole)


@final
@dataclass(frozen=True)
class _WhereItMoves(AbstractMask):
    """Leaves out where joints reverse or rest, except those that rest all the time."""

    mask: ReversalMask = ReversalMask()  # noqa: RUF009  # frozen

    def halo(self, fs: float) -> float:
        return self.mask.halo(fs)

    def weight(self, qd: Array, fs: float) -> Array:
        weight = self.mask.weight(qd, fs)
        return np.where((weight == 0).all(axis=-1, keepdims=True), 1.0, weight)


RESOLUTION = 0.5
"""Distance of the frequencies that are looked at [Hz]."""

QUIET = 0.02
"""Gain of the operator, as a share of that at rest, below which a frequency is above its band."""

MIN_FREQUENCIES = 8
"""Frequencies above the band that it takes to distinguish two kinds of noise."""

FAINT = 1e-6
"""Frequencies at which a kind of noise is below this share of its largest say nothing of it."""


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
    log, fs = signals.log, signals.fs
    length = min(left.residual.shape[-1], round(fs / RESOLUTION))
    f, S = scipy.signal.welch(left.residual * left.weight, fs, nperseg=length, detrend="constant")
    S = S / np.maximum(np.mean(left.weight**2, axis=-1, keepdims=True), 1e-300)
    passed = _gain(chain.operator.response(fs), f, fs)
    kinds = np.stack([_gain(impulse, f, fs) ** 2 for impulse in _impulses(log, chain)])
    above = (passed < QUIET * passed[0]) & (f > f[np.argmax(passed < QUIET * passed[0])]) & (f < 0.95 * fs / 2)
    above &= (kinds > FAINT * kinds.max(axis=1, keepdims=True)).any(axis=0)
    if np.count_nonzero(above) < MIN_FREQUENCIES:
        return np.full(len(S), np.nan)
    levels = np.stack(two_levels(kinds[0, above], kinds[1, above], S[:, above]), axis=-1)
    return np.sqrt(scipy.integrate.trapezoid(levels @ kinds * passed**2, f, axis=-1))


def _impulses(log: MotionLog, chain: Chain) -> tuple[Array, Array]:
    """Return what an impulse of the torque, and one of the position, leave in the torque's residual."""
    fs = log.fs
    x = np.zeros(2 * int(np.ceil(chain.halo(fs, log.torque) * fs)) + 101)
    x[len(x) // 2] = 1.0
    x = chain.prefilter.apply(x, fs)
    position = chain.differentiator.derivative(chain.differentiator.derivative(x, fs), fs)
    return chain.alignment.align(x[None], replace(log.torque, lags=()), fs).mean[0], position


def _gain(impulse: Array, f: Array, fs: float) -> Array:
    """Return the size of the frequency response of an impulse response."""
    _, response = scipy.signal.freqz(impulse, worN=f, fs=fs)
    return np.abs(response)


BINS = 8
"""Stretches of equal numbers of instants into which each joint's motion is cut: fewer miss a bump, more need longer logs."""

WRONG = 1e-3
"""p value, of all that is asked together, below which a fit lacks something."""

DEPENDENT = 1e-6
"""Share of a column's square below which what the parameters leave of it is rounding."""


@final
@dataclass(frozen=True)
class Lack:
    """What a joint's residual torque depends on."""

    joint: int
    """Of the torque."""
    over: str
    """"velocity", "position", "load" or "time": a name of `OVER`."""
    p: float
    """Probability that noise alone shows as much, anywhere where it was looked for."""
    size: float
    """Rms of it in the torque [N m]."""


def lack_of_fit(problem: Problem, X: Array) -> tuple[Lack, ...]:
    """Return how the residuals of the explicit model depend on velocity, position, load and time, the most significant first.

    Rows of one run are made independent by the covariance that noise gives them; what they leave is regressed on functions of
    one variable of one joint, constant in each of `BINS` stretches. The reduction of the sum of squares is distributed as chi^2
    if noise alone is left (the F test of added regressors: N. R. Draper and H. Smith, "Applied Regression Analysis", Wiley
    1998, chapter 6); p values are multiplied by the number of tests (Bonferroni). Of long logs some pieces are looked at.

    Parameters
    ----------
    problem : Problem
        What was fitted; one run.
    X : Array, shape (p,)
        The estimate.

    Raises
    ------
    IdentificationError
        If there are too few rows, or the covariance of the rows is singular.
    """
    explicit = problem.with_model(ExplicitModel())
    parts = explicit.parts
    own, y, raw = (np.concatenate(x) for x in zip(*map(_whitened, parts), strict=True))
    used = int(np.count_nonzero(own.any(axis=1)))  # rows that the mask takes are zero
    freedom = used - own.shape[1] - BINS
    if freedom < BINS:
        raise IdentificationError(f"{used} rows for {own.shape[1]} parameters are too few to test the residuals")
    if not (np.isfinite(own).all() and np.isfinite(y).all()):
        raise IdentificationError("the covariance of the rows is singular, so that their residuals cannot be tested")
    Q, R = np.linalg.qr(own)
    left = y - Q @ (Q.T @ y)
    level = max(1.0, float(left @ left) / freedom)
    found = list[tuple[float, Lack]]()
    variables = _variables(parts, problem, X)
    for (joint, over), functions in variables.items():
        made = [_rows_of(part.rows, joint, f) for part, f in zip(parts, functions, strict=True)]
        E = np.concatenate([part.whitening.whiten(x) for part, x in zip(parts, made, strict=True)])
        log_p, b = _tested(E, Q, left, level)
        size = np.concatenate(made) @ b - raw @ np.linalg.lstsq(R, Q.T @ (E @ b), rcond=None)[0]
        there = np.concatenate([part.rows.valid & (part.rows.group == joint) for part in parts])
        p = min(1.0, float(np.exp(log_p)) * len(variables))
        found.append((log_p, Lack(joint, over, p, float(np.sqrt(np.mean(size[there] ** 2))) if there.any() else 0.0)))
    return tuple(lack for _, lack in sorted(found, key=lambda each: each[0]))


def _tested(E: Array, Q: Array, left: Array, level: float) -> tuple[float, Array]:
    """Return the logarithm of the p value of columns E beside those of Q, and what multiplies them."""
    beside = E - Q @ (Q.T @ E)
    scale = np.maximum(np.linalg.norm(E, axis=0), 1e-300)
    U, s, V = np.linalg.svd(beside / scale, full_matrices=False)
    kept = s > np.sqrt(DEPENDENT)
    z = U[:, kept].T @ left
    b = (V[kept].T @ (z / s[kept])) / scale
    return float(scipy.stats.chi2.logsf(z @ z / level, kept.sum())) if kept.any() else 0.0, b


def _whitened(part: LogRows) -> tuple[Array, Array, Array]:
    """Return W and Y made independent, and W as it is."""
    z = part.whitening.whiten(part.unbiased.joined)
    return z[..., :-1], z[..., -1], part.rows.W


def _rows_of(rows: Rows, joint: int, functions: Array) -> Array:
    """Return the rows of functions that are torques of a joint, shape (r, function)."""
    (to_rows,) = rows.maps
    found = np.zeros((len(functions), len(rows.time) // rows.kinds, rows.kinds))
    found[..., joint] = to_rows.outside[joint] * to_rows.kernel.apply(to_rows.inside[joint] * functions)
    return found.reshape(len(functions), -1).T


Variable = Callable[[Signals, Array, int], tuple[Array, Array]]
"""Returns, of signals, the torques that the model gives and a joint, a variable and what its stretches are multiplied by."""


def _velocity(signals: Signals, tau: Array, j: int) -> tuple[Array, Array]:
    return signals.state.qd[j], np.ones(tau.shape[-1])


def _position(signals: Signals, tau: Array, j: int) -> tuple[Array, Array]:
    return signals.state.q[j], np.ones(tau.shape[-1])


def _load(signals: Signals, tau: Array, j: int) -> tuple[Array, Array]:
    return np.abs(tau[j]), np.sign(signals.state.qd[j])


def _time(signals: Signals, tau: Array, j: int) -> tuple[Array, Array]:
    return np.arange(tau.shape[-1]) / signals.fs, np.sign(signals.state.qd[j])


OVER: Mapping[str, Variable] = {"velocity": _velocity, "position": _position, "load": _load, "time": _time}


def _variables(parts: tuple[LogRows, ...], problem: Problem, X: Array) -> dict[tuple[int, str], list[Array]]:
    """Return the functions of every joint and variable, part by part, shape (function, time) each."""
    signals = [part.signals for part in parts]
    torques = [ExplicitModel().equations(problem.basis, one).predicted(X) for one in signals]
    found = dict[tuple[int, str], list[Array]]()
    for j in range(problem.basis.n):
        for over, of in OVER.items():
            made, begin = list[tuple[Array, Array]](), 0.0
            for one, tau in zip(signals, torques, strict=True):
                x, factor = of(one, tau, j)
                made.append((x + (begin if over == "time" else 0.0), factor))
                begin += tau.shape[-1] / one.fs
            seen = np.concatenate([x[one.weight[j] > 0] for (x, _), one in zip(made, signals, strict=True)])
            if len(seen) and seen.max() > seen.min():
                found[j, over] = _stretches(made, np.quantile(seen, np.linspace(0, 1, BINS + 1)[1:-1]))
    return found


def _stretches(made: list[tuple[Array, Array]], edges: Array) -> list[Array]:
    places = [np.searchsorted(edges, x) for x, _ in made]
    return [np.array([(at == k) * factor for k in range(BINS)]) for at, (_, factor) in zip(places, made, strict=True)]
