"""Residuals: how sums of them scatter, and errors on stretches of rows, each predicted by a fit of the others."""

from collections.abc import Sequence

import numpy as np

from idbench.identify.arrays import TINY, Array
from idbench.identify.estimators.leave_out import Stretches, left_out
from idbench.identify.estimators.log_rows import LogRows, split_by_log
from idbench.identify.estimators.problem import Problem
from idbench.identify.rows.factors import CONVERGED

MEMORY = 3.0  # Time [s] over which residuals are correlated: 0.2 to 3 s on real robots


def held_torque(parts: Sequence[LogRows]) -> Array:
    """The rows of the torque of parameters that are held, and of laws about their shapes: measured ones less Y, shape (r,)."""
    each = ((part.rows, part.rows.maps[0]) for part in parts)
    return np.concatenate([to_rows.measurement(to_rows.signals.torque.mean) - rows.Y for rows, to_rows in each])


def torque_squares(problem: Problem) -> Array:
    """Sum of the squares of each joint's measured torque in the explicit rows, shape (joint,)."""
    rows = problem.rows
    return np.asarray(np.sum(rows.by_kind((rows.Y + held_torque(problem.parts)) * rows.valid) ** 2, axis=-1))


def held_out_errors(problem: Problem) -> Array:
    """Rms errors of each joint on stretches of the rows that were not fitted [% of its torque], shape (joint,).

    By weighted least squares, as fits of single stretches are by then.
    """
    rows, fit = problem.explicit.rows, problem.explicit.factors.fit(CONVERGED)
    weight = np.tile(fit.weight, len(rows.time) // rows.kinds) * rows.valid
    return errors_of_stretches(problem.explicit, rows.W * weight[:, None], rows.Y * weight, rows.W)


def errors_of_stretches(problem: Problem, white: Array, Y: Array, plain: Array) -> Array:
    """Rms errors on stretches, each predicted by a fit of the others, of rows (white, Y) made independent [% of the torque].

    Next to nothing of a joint that has no torque.
    """
    rows, own = problem.rows, len(plain)
    parts, stretches = problem.parts, Stretches.of(problem.parts)
    joined = np.column_stack([white, Y])
    X = left_out(stretches.products(parts, split_by_log(joined[:own], parts)), joined[own:])
    stretch = np.concatenate([stretches.at(k, part.rows.time) for k, part in enumerate(parts)])
    errors = rows.Y - np.sum(plain * X[stretch], axis=-1)
    squares, of_all = np.sum(rows.by_kind(errors * rows.valid) ** 2, axis=-1), torque_squares(problem)
    share = np.divide(squares, of_all, out=np.zeros_like(squares), where=of_all > TINY)
    return np.asarray(100 * np.sqrt(np.maximum(share, TINY)))


def noise_errors(problem: Problem) -> Array:
    """Rms of the noise in the rows of each joint [% of its torque], shape (joint,)."""
    rows, explicit = problem.explicit.rows, problem.explicit
    variance = np.concatenate([part.noisy.variance(explicit.noise) for part in explicit.parts])
    squares = np.maximum(np.sum(rows.by_kind(variance * rows.valid), axis=-1), 0.0)
    return np.asarray(100 * np.sqrt(squares / np.maximum(torque_squares(explicit), TINY)))


def left_unexplained(before: Array, after: Array, noise: Array) -> Array:
    """Share of the squared errors beyond noise that is left once something is mended, joint by joint; 1 where there were none.

    Where errors are below the noise, that was too large, as a ripple of many waves counts as noise: the share is of all then.

    Parameters
    ----------
    before, after : Array, shape (joint,)
        Errors on stretches that were not fitted [%].
    noise : Array, shape (joint,)
        What noise makes of them [%].
    """
    beyond, rest = (np.maximum(x**2 - np.where(before <= noise, 0.0, noise**2), 0.0) for x in (before, after))
    return np.divide(rest, beyond, out=np.ones_like(rest), where=beyond > 0)


def scatter_of_sums(part: LogRows, left: Array, rest: Array) -> Array:
    """Covariance of left' rest, rest being as correlated as it is, and not less than white, shape (g, g)."""
    to_rows = part.rows.maps[0]
    lags = min(max(2, int(MEMORY * to_rows.signals.fs / to_rows.grid.step)), to_rows.grid.count)
    c = np.stack([part.rows.by_kind(x) for x in left.T], axis=-1)
    e = part.rows.by_kind(rest * part.rows.valid)
    count = np.maximum(part.rows.count, 1)
    taper = 0.5 + 0.5 * np.cos(np.pi * np.arange(lags) / lags)
    each = [
        np.einsum("k,kta,ktb->ab", np.sum(e[:, k:] * e[:, : e.shape[1] - k], axis=1) / count, c[:, k:], c[:, : c.shape[1] - k])
        for k in range(lags)
    ]
    white = each[0]
    size = np.sqrt(np.maximum(np.diagonal(white), TINY))
    total = white + sum((w * (x + x.T) for w, x in zip(taper[1:], each[1:], strict=True)), start=np.zeros(()))
    values, axes = np.linalg.eigh(total / np.outer(size, size))
    return np.asarray((axes * np.maximum(values, 1.0)) @ axes.T * np.outer(size, size))


def variance_of_sums(e: Array, step: float) -> Array:
    """Variance of sums of residuals, over that of as many white ones, at least 1, shape (joint,).

        1 + 2 sum_l w(l) rho(l),   w a Hann taper of `MEMORY`

    Parameters
    ----------
    e : Array, shape (joint, row)
        Residuals.
    step : float
        Time from row to row [s].
    """
    lags = min(max(2, int(MEMORY / step)), e.shape[1])
    taper = 0.5 + 0.5 * np.cos(np.pi * np.arange(lags) / lags)
    sums = np.stack([np.sum(e[:, k:] * e[:, : e.shape[1] - k], axis=1) for k in range(lags)], axis=1)
    return np.maximum(1.0, 2 * sums @ taper / np.maximum(sums[:, 0], TINY) - 1)
