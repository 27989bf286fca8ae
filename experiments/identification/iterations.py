"""What is said of estimators that simulate: how often, and whether noise in W matters."""

from collections.abc import Iterator
from typing import Any

import numpy as np

from experiments.identification.identified import Identified
from identify import Estimate, InstrumentalVariables, noise_in_rows
from identify.judge.noise_in_rows import LEVEL


def words_of_iterations(found: Identified) -> Iterator[str]:
    """Yield what is said of the estimates, model by model."""
    for model, estimate in _unmoved(found).items():
        if estimate.simulations is None:
            continue
        yield f"{model}: settled after {int(estimate.simulations)} simulations"
        if isinstance(found.solver, InstrumentalVariables):
            test = noise_in_rows(estimate)
            k = int(np.argmax(np.abs(test.off)))
            yield (
                f"{model}: does noise in W matter here? {'Yes' if test.matters else 'No'}: without instruments "
                f"{found.basis.names[k]} is off by {abs(test.off[k]):.2g} sigma"
                + (" more than chance would have it" if test.probability < LEVEL else ", as chance has it")
                + f" (Durbin-Wu-Hausman: chi2 = {test.statistic:.3g}, {int(test.freedom)} degrees of freedom, "
                f"p = {test.probability:.2g})"
            )


def iterations(found: Identified) -> dict[str, Any]:
    """Return what a summary.json says of it."""
    every = {model: e for model, e in _unmoved(found).items() if e.path}
    return {
        model: {
            "simulations": None if e.simulations is None else int(e.simulations),
            "path": [[float(x) if np.isfinite(x) else None for x in X] for X in e.path],
            **(_test(found, model) if isinstance(found.solver, InstrumentalVariables) else {}),
        }
        for model, e in every.items()
    }


def _unmoved(found: Identified) -> dict[str, Estimate]:
    """Return the estimates as they came, before bodies that can exist were asked for."""
    outcomes = found.unconstrained if found.known is None else found.outcomes
    return {model: outcome for model, outcome in outcomes.items() if isinstance(outcome, Estimate)}


def _test(found: Identified, model: str) -> dict[str, Any]:
    test = noise_in_rows(_unmoved(found)[model])
    return {
        "noise_in_W": {
            "matters": bool(test.matters),
            "probability": float(test.probability),
            "off_by_sigma": test.off.tolist(),
        }
    }
