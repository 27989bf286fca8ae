"""Residuals: how sums of them scatter, and errors on stretches of rows, each predicted by a fit of the others."""

import numpy as np

from idbench.identify.arrays import TINY, Array
from idbench.identify.estimators.log_rows import LogRows
from idbench.identify.estimators.model_error import MEMORY
from idbench.identify.estimators.problem import Problem
from idbench.identify.rows.factors import CONVERGED

BLOCKS = 5
"""Stretches of the rows, each of which is predicted by a fit of the others."""

SHOWN = 1e-6
"""Share of the largest singular value, of columns scaled to unit length, below which stretches do not show a direction."""


def held_out_errors(problem: Problem) -> Array:
    """Return the rms errors of each joint on stretches of the rows that were not fitted [% of its torque], shape (joint,).

    By weighted least squares, as fits of single stretches are by then.
    """
    rows, fit = problem.explicit.rows, problem.explicit.factors.fit(CONVERGED)
    weight = np.tile(fit.weight, len(rows.time) // rows.kinds) * rows.valid
    return errors_of_stretches(problem.explicit, rows.W * weight[:, None], rows.Y * weight, rows.W)


def errors_of_stretches(problem: Problem, white: Array, Y: Array, plain: Array) -> Array:
    """Return what fits of `BLOCKS` - 1 stretches leave of the other, of rows (white, Y) that are made independent."""
    rows, own = problem.rows, len(plain)
    block = np.r_[np.arange(own) * BLOCKS // own, np.full(len(Y) - own, -1)]
    errors, whole = np.zeros(own), np.linalg.norm(white, axis=0)
    for b in range(BLOCKS):
        size = np.linalg.norm(white[block != b], axis=0)
        size = np.where(size > SHOWN * whole, size, np.inf)  # a push is in one stretch alone
        x = np.linalg.lstsq(white[block != b] / size, Y[block != b], rcond=SHOWN)[0] / size
        mine = block[:own] == b
        errors[mine] = rows.Y[mine] - plain[mine] @ x
    squares, of_all = (np.sum(rows.by_kind(x * rows.valid) ** 2, axis=-1) for x in (errors, rows.Y))
    return np.asarray(100 * np.sqrt(np.maximum(squares, TINY) / np.maximum(of_all, TINY)))


def scatter_of_sums(part: LogRows, left: Array, rest: Array) -> Array:
    """Return the covariance of left' rest, rest being as correlated as it is, and not less than white, shape (g, g)."""
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
