"""What is said of estimators that simulate: how often, and whether noise in W matters."""

from collections.abc import Iterator
from typing import Any

import numpy as np

from idbench.experiments.identification.fit import Fit
from idbench.experiments.results.writing import finite
from idbench.identify import Estimate, InstrumentalVariables, WeightedLeastSquares, noise_in_rows
from idbench.identify import estimate as identified_by
from idbench.identify.judge.excitation import LEVEL

FAR = 5.0  # Difference from least squares, in sigma, that is not chance


def words_of_iterations(fit: Fit) -> Iterator[str]:
    """Yield what is said of the estimates, model by model."""
    for model, estimate in fit.estimates.items():
        if estimate.simulations is None:
            continue
        yield f"{model}: converged after {int(estimate.simulations)} simulations"
        if isinstance(fit.request.method.estimator, InstrumentalVariables):
            test = noise_in_rows(estimate)
            k = int(np.argmax(np.abs(test.off)))
            yield (
                f"{model}: does noise in W matter here? {'Yes' if test.matters else 'No'}: without instruments "
                f"{fit.basis.names[k]} is off by {abs(test.off[k]):.2g} sigma"
                + (" (significant)" if test.probability < LEVEL else " (not significant)")
                + f" (Durbin-Wu-Hausman: chi2 = {test.statistic:.3g}, {int(test.freedom)} degrees of freedom, "
                f"p = {test.probability:.2g})"
            )
        elif "loop" in fit.request.method.estimator.needs:
            yield from _far_from_least_squares(fit, model, estimate)


def _far_from_least_squares(fit: Fit, model: str, estimate: Estimate) -> Iterator[str]:
    """Yield what it means if an estimator that believes the simulated loop does not agree with the measured motion."""
    plain = identified_by(estimate.problem, WeightedLeastSquares(), throw=False)
    # Its own sigma would be as large as the loop is wrong.
    off = np.abs(estimate.X - plain.X) / plain.calibrated_sigma
    if not np.nanmax(off) < FAR:
        k = int(np.nanargmax(off))
        yield (
            f"{model}: {fit.basis.names[k]} is {off[k]:.2g} sigma away from least squares of the measured motion: either "
            "noise in W matters, or the loop is not that of the log, on which "
            f"{fit.request.method.estimator_name} relies; IV does not"
        )


def iterations(fit: Fit) -> dict[str, Any]:
    """Its part of summary.json."""
    return {
        model: {
            "simulations": None if e.simulations is None else int(e.simulations),
            "path": [[finite(x) for x in X] for X in e.path],
            **({"noise_in_W": _test(e)} if isinstance(fit.request.method.estimator, InstrumentalVariables) else {}),
        }
        for model, e in fit.estimates.items()
        if e.path
    }


def _test(estimate: Estimate) -> dict[str, Any]:
    test = noise_in_rows(estimate)
    return {"matters": bool(test.matters), "probability": float(test.probability), "off_by_sigma": test.off.tolist()}
