"""How much each parameter moves from log to log, beyond what a log by itself shows."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from idbench.identify.arrays import TINY, Array
from idbench.identify.estimators.log_rows import LogRows
from idbench.identify.estimators.model_error import ModelError
from idbench.identify.estimators.solution import OfWeightedRows, OfWhitenedRows
from idbench.identify.rows.factors import Factor, triangular


class BetweenLogs(NamedTuple):
    """The scatter of parameters between logs."""

    variance: Array
    """Of each parameter between logs, tau^2, shape (p,)."""

    logs: int
    """Number of logs that determine all parameters by themselves."""


def between_logs(parts: Sequence[LogRows], solution: OfWeightedRows | OfWhitenedRows) -> BetweenLogs | None:
    """Return the scatter of parameters between the logs of a fit; None unless two of them determine all parameters.

    With x_i the estimates of one parameter from k logs, w_i = 1 / C_i their weights, and Q = sum w_i (x_i - xbar)^2,

        tau^2 = max(0, (Q - (k - 1)) / (sum w - sum w^2 / sum w))

    (R. DerSimonian and N. Laird, "Meta-analysis in clinical trials", Controlled Clinical Trials 7 (1986) 177-188). An estimate
    from one log is off by C_i + tau^2, that of k logs together by C + tau^2 / k.

    Parameters
    ----------
    parts : sequence of LogRows
        Rows of each log of a single run.
    solution : OfWeightedRows or OfWhitenedRows
        Of all of them.
    """
    names, precision = parts[0].rows.names, np.linalg.pinv(solution.inverse, hermitian=True)
    X, C = list[Array](), list[Array]()
    for part, rows, G in zip(parts, solution.independent(parts), solution.influence(parts), strict=True):
        factor = Factor(triangular(rows), np.array(len(rows)), names)
        if not factor.determined:
            continue
        alone = G @ precision @ factor.inverse(factor.determined)
        X.append(factor.solution(factor.determined))
        noise = part.covariance.of_sums(alone)
        C.append(np.diagonal(noise + ModelError.of([part], X[-1], [alone], 1.0, np.diagonal(noise)).covariance))
    if len(X) < 2:
        return None
    return BetweenLogs(scatter(np.array(X), np.array(C))[1], len(X))


def scatter(x: Array, C: Array) -> tuple[Array, Array]:
    """Q and tau^2 (see `between_logs`) of estimates x with variances C, shape (k, ...) each, shape (...) each."""
    w = 1 / np.maximum(C, TINY)
    whole = w.sum(axis=0)
    Q = np.sum(w * (x - np.sum(w * x, axis=0) / whole) ** 2, axis=0)
    return Q, np.maximum(Q - (len(x) - 1), 0.0) / np.maximum(whole - np.sum(w**2, axis=0) / whole, TINY)
