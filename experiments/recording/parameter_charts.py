"""Charts of estimates: every parameter with its interval beside the truth, and how well W tells them apart."""

from math import ceil

import numpy as np
import numpy.typing as npt

from experiments.identification.fit import Fit
from experiments.recording.chart import NARROW, SQUARE, SYMBOLS, Chart
from experiments.recording.columns import part
from experiments.recording.scales import Signed, decades, linear, listed
from experiments.recording.stream import Stream
from experiments.style import GREY, model_color
from identify import Array

MOST = 13
"""Parameters of a chart."""

SIGMAS = 2.0
"""Half the length of an interval."""

ASIDE = 0.22
"""How far the models of a parameter stand apart, of its room."""


def send_parameters(stream: Stream, at: str, fit: Fit, number: int = 0) -> None:
    """Send every parameter's error, or its deviation from the first model's, with its interval; and the singular values."""
    names = [f"{name} = 0" if x == 0 else name for name, x in zip(fit.basis.names, _reference(fit), strict=True)]
    scale = _scale(fit)
    for k, members in enumerate(_parts(fit)):
        mine = [names[p] for p in members]
        place = f"{at}/parameters/{k}_{part(fit.basis.names[members[0]])}_to_{part(fit.basis.names[members[-1]])}"
        chart = Chart(stream, place, scale, listed("", mine), SQUARE)
        ends = np.array([-0.5, len(members) - 0.5])
        chart.line("true" if fit.truth else next(iter(fit.estimates)), np.zeros(2), ends, GREY, listed=False)
        for i, (form, estimate) in enumerate(fit.estimates.items()):
            off, sigma = _deviation(fit, estimate.X)[members], _in_percent(fit, estimate.best_sigma)[members]
            y = np.arange(float(len(members))) + ASIDE * (i - (len(fit.estimates) - 1) / 2)
            color = model_color(form, number)
            reach = np.stack([off - SIGMAS * sigma, off + SIGMAS * sigma], axis=1)
            chart.segments(form, reach, np.stack([y, y], axis=1), color, 1.5)
            chart.marks(form, off, y, color, SYMBOLS[i % len(SYMBOLS)])
    _singular_values(stream, at, fit, number)


def _parts(fit: Fit) -> list[npt.NDArray[np.intp]]:
    """Return the parameters of each chart, by joints."""
    order = sorted(range(len(fit.basis.names)), key=lambda p: fit.basis.parameters[p].joint or 0)
    return np.array_split(np.array(order, dtype=np.intp), ceil(len(order) / MOST))


def _reference(fit: Fit) -> Array:
    """Return what estimates are compared with: the truth, or the first of them."""
    return np.array(list(fit.truth.values())) if fit.truth else next(iter(fit.estimates.values())).X


def _in_percent(fit: Fit, values: Array) -> Array:
    reference = np.abs(_reference(fit))
    return 100 * values / np.where(reference == 0, np.nan, reference)


def _deviation(fit: Fit, X: Array) -> Array:
    return _in_percent(fit, X - _reference(fit))


def _scale(fit: Fit) -> Signed:
    """Return an axis for all parameters, linear up to what the best of them is sure of."""
    sigmas = [SIGMAS * _in_percent(fit, estimate.best_sigma) for estimate in fit.estimates.values()]
    off = [_deviation(fit, estimate.X) for estimate in fit.estimates.values()]
    every = np.concatenate([np.abs(x) + s for x, s in zip(off, sigmas, strict=True)])
    every = every[np.isfinite(every) & (every > 0)]
    low, high = (float(every.min()), float(every.max())) if len(every) else (1.0, 1.0)
    bend = 10.0 ** np.floor(np.log10(max(low, high * 1e-6)))
    what = "error" if fit.truth else f"difference from {next(iter(fit.estimates))}"
    return Signed(f"{what} [%], and two sigma; beyond {bend:g} in decades", -1.3 * high, 1.3 * high, bend)


def _singular_values(stream: Stream, at: str, fit: Fit, number: int) -> None:
    """Send the singular values of W, over the largest; beyond the conditions that they allow, parameters are not told apart."""
    values = {
        form: np.linalg.svd(estimate.problem.factors.together.R_W, compute_uv=False) for form, estimate in fit.estimates.items()
    }
    shares = {form: s / s[0] for form, s in values.items()}
    numbers = np.arange(1.0, 1 + len(fit.basis.names))
    x, y = linear("number", numbers), decades("over the largest", *shares.values())
    chart = Chart(stream, f"{at}/singular_values", x, y, NARROW)
    for i, (form, share) in enumerate(shares.items()):
        chart.marks(form, numbers, share, model_color(form, number), SYMBOLS[i % len(SYMBOLS)])
        chart.line(f"{form}: {1 / share[-1]:.3g}", numbers, share, model_color(form, number))
