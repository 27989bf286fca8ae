"""Which model stands for the others on the screen, where tables of all would be long."""

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from idbench.experiments.identification.fit import Fit
from idbench.identify.arrays import Array

FEW = 3
"""Joints up to which tables of all models can be seen at once."""

SAME = 0.99
"""Errors in multiples of an earlier model's from which on a later one is no better."""


def shown_whole(fit: Fit, asked: bool) -> tuple[str, ...]:
    """Return the models whose tables are shown whole: all if they were asked for, or joints are few; else the leading one."""
    every = tuple(fit.estimates)
    if asked or fit.basis.n <= FEW or len(every) < 2:
        return every
    return (leading({model: np.sqrt(np.maximum(1 - share, 0)) for model, share in fit.explained.items()}),)


def leading(errors: Mapping[str, Array]) -> str:
    """Return the model with the least errors, shape (joint,) each, on average of their logarithms; of equals the first."""
    first, *others = errors
    for model in others:
        ratio = np.log(np.maximum(errors[model], 1e-300) / np.maximum(errors[first], 1e-300))
        if (ratio := ratio[np.isfinite(ratio)]).size and ratio.mean() < np.log(SAME):
            first = model
    return first


def in_lines(fit: Fit, whole: Sequence[str]) -> Iterator[str]:
    """Yield a line of each model on its fit as a whole, and how far those are from the leading one that are not shown whole."""
    lead = fit.estimates[whole[0]]
    for model, estimate in fit.estimates.items():
        share = _range(fit.explained[model])
        words = f"{model}: Cond(W) {estimate.condition_number:.1f}, {estimate.row_count} rows, explains {share} of the torques"
        if model not in whole:
            sigma = np.maximum(np.hypot(estimate.standard_errors, lead.standard_errors), 1e-300)
            far = float(np.max(np.abs(estimate.X - lead.X) / sigma))
            words += f"; parameters within {far:.2g} sigma of the {whole[0]} model's (--model {model} shows them)"
        yield words


def _range(share: Array) -> str:
    known = 100 * share[np.isfinite(share)]
    return f"{max(known.min(), 0):.3f} to {known.max():.3f} %" if known.size else "nothing"
