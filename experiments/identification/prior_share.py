"""How near the links of a robot are to those of its file, decided by the log."""

from collections.abc import Sequence

import numpy as np

from idbench.experiments.identification.request import Request
from idbench.identify import Array, IdentificationError, MotionLog, estimate
from idbench.identify.rows.factors import Factor, prior_rows, triangular

SHARES = tuple(10 ** (-k / 4) for k in range(-4, 7))
"""Relative changes of links that are tried: from ten times to 3 %."""

BLOCKS = 5
"""Stretches of the rows, each of which is predicted from the others."""


def chosen_share(request: Request, logs: Sequence[MotionLog]) -> float | None:
    """Return the share with which stretches of the logs are predicted best from the others; None where that is not known.

    The errors are those of rows made independent, |W_b X - Y_b|^2, X being the estimate of the other blocks.
    """
    problem = request.problem(logs)
    try:
        found = estimate(problem, request.solver)
    except IdentificationError:
        return None
    rows = found.independent_rows()
    if rows is None or rows.ndim > 2:
        return None
    blocks = [triangular(block) for block in np.array_split(rows, BLOCKS)]
    return min(SHARES, key=lambda share: _error(request, blocks, share))


def _error(request: Request, blocks: Sequence[Array], share: float) -> float:
    """Return the sum of squared errors of the blocks, with a share."""
    prior, p = request.robot_model.prior(share), blocks[0].shape[-1] - 1
    assert prior is not None
    total = 0.0
    for k, block in enumerate(blocks):
        R = triangular(np.concatenate([*blocks[:k], *blocks[k + 1 :]]))
        factor = Factor(R, np.array(len(R)), ("",) * p, prior_rows(prior, R, np.ones(())))
        X = factor.solution(np.array(factor.determined))
        total += float(np.sum((block[:, :p] @ X - block[:, p]) ** 2))
    return total if np.isfinite(total) else np.inf
