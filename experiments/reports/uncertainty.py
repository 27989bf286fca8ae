"""What limits a fit's standard errors, in words: correlations, scatter between logs, and logs that are too short."""

from collections.abc import Iterator

import numpy as np

from idbench.experiments.identification.fit import Fit
from idbench.identify import Estimate
from idbench.identify.arrays import TINY

STRONG = 0.9  # Correlation above which two parameters are named: a change of one is then hardly told from one of the other

DELAY = "the delay"

NAMED = 4  # Pairs, or parameters, that are named; of more their number is

ENOUGH = 20.0
"""Length of logs [s] below which the error of the model is not well known: of fewer than ten stretches of 2 s, a standard
deviation is known to a quarter at best."""

SHOWN = 3.0  # Standard errors that a parameter must exceed for its scatter to be named as a share of it
DISTINCT = 0.05  # Share of its value below which the scatter of a parameter between logs is not named


def words_of_uncertainty(fit: Fit) -> Iterator[str]:
    """Yield what limits the standard errors of the leading model."""
    estimate = fit.estimates[fit.leading]
    if pairs := correlated(estimate):
        each = [f"{a} and {b} ({r:+.2f})" if b != DELAY else f"{a} and {b} ({r:.2f}, of its size)" for a, b, r in pairs[:NAMED]]
        yield f"strongly correlated: {', '.join(each)}{_more(len(pairs))}"
    if estimate.between_logs is not None:
        X, sigma = estimate.X, estimate.standard_errors
        share = np.sqrt(estimate.between_logs.variance) / np.maximum(np.abs(X), TINY)
        if order := [k for k in np.argsort(-share) if share[k] > DISTINCT and abs(X[k]) > SHOWN * sigma[k]]:
            each = [f"{estimate.names[k]} {100 * share[k]:.2g} %" for k in order[:NAMED]]
            yield f"from log to log parameters move, beyond what one log shows, by {', '.join(each)}{_more(len(order))}"
    error, seconds = estimate.model_error, sum(log.samples / log.fs for log in fit.logs.fitted)
    if error is not None and error.covariance.any() and seconds < ENOUGH and not fit.logs.fitted[0].poses:
        yield f"{seconds:.2g} s are too few to know what this model misses: a longer log, or a second one, shows it"


def error_shares(estimate: Estimate) -> Iterator[tuple[str, float, str, float]]:
    """Yield what the variances of the parameters consist of: cause, median share [%], the parameter with most of it, its share.

    var X = noise + delay + model + what changes from log to log
    """
    total = np.maximum(estimate.standard_errors**2, TINY)
    delay, error = np.diagonal(estimate.delay_covariance), estimate.model_error
    parts = {"noise of the logs": estimate.noise_sigma**2 - delay, "delay of the torques": delay}
    if error is not None:
        parts["what the model misses"] = np.diagonal(np.broadcast_to(error.covariance, estimate.covariance.shape))
        parts["change from log to log"] = np.broadcast_to(error.scatter, total.shape)
    for cause, variance in parts.items():
        share = 100 * variance / total
        if not np.isfinite(share).any() or not np.any(variance):  # a cause that is not known here
            continue
        most = int(np.nanargmax(share))
        yield cause, float(np.nanmedian(share)), estimate.names[most], float(share[most])


def correlated(estimate: Estimate) -> list[tuple[str, str, float]]:
    """Return the pairs of parameters, or of a parameter and the delay, that are strongly correlated, the strongest first."""
    C = estimate.within_covariance
    sigma = np.sqrt(np.maximum(np.diagonal(C), TINY))
    R = C / np.outer(sigma, sigma)
    of_functions = [p.is_random_effect for p in estimate.problem.basis.parameters]
    R[of_functions], R[:, of_functions] = 0.0, 0.0
    found = [(estimate.names[i], estimate.names[j], float(R[i, j])) for i, j in np.argwhere(np.triu(np.abs(R), 1) > STRONG)]
    if estimate.delay_covariance.any():
        of_delay = np.sqrt(np.maximum(np.diagonal(estimate.delay_covariance), 0.0)) / sigma
        found += [(estimate.names[k], DELAY, float(of_delay[k])) for k in np.flatnonzero(of_delay > STRONG)]
    return sorted(found, key=lambda pair: -abs(pair[2]))


def _more(count: int) -> str:
    return f", and {count - NAMED} more" if count > NAMED else ""
