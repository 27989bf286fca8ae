"""How near the links of a robot are to those of its file, decided by the log."""

from collections.abc import Sequence

import numpy as np

from idbench.experiments.identification.request import Request
from idbench.identify import Array, IdentificationError, MotionLog, estimate
from idbench.identify.estimators.leave_out import Stretches, left_out
from idbench.identify.rows.factors import prior_rows, triangular

SHARES = tuple(10 ** (-k / 4) for k in range(-4, 7))  # Relative changes of links that are tried: from ten times to 3 %


def chosen_share(request: Request, logs: Sequence[MotionLog]) -> float | None:
    """Return the share with which stretches of the logs are predicted best from the others; None where that is not known.

    The errors are those of rows made independent, |W_b X - Y_b|^2, X being the estimate of the other blocks.
    """
    problem = request.problem(logs)
    try:
        found = estimate(problem, request.method.estimator)
    except IdentificationError:
        return None
    rows = None if found.solution is None else found.solution.independent(problem.parts)
    if rows is None or rows[0].ndim > 2:
        return None
    products, R = Stretches.of(problem.parts).products(problem.parts, rows), triangular(np.concatenate(rows))
    return min(SHARES, key=lambda share: _error(request, products, R, share))


def _error(request: Request, products: Array, R: Array, share: float) -> float:
    """Sum of squared errors of the stretches, with a share."""
    prior = request.robot_model.prior(share)
    assert prior is not None
    X = left_out(products, prior_rows(prior, R, np.ones(())))[:-1]
    x = np.concatenate([X, -np.ones((len(X), 1))], axis=1)
    total = float(np.einsum("bi,bij,bj->", x, products, x))
    return total if np.isfinite(total) else np.inf
