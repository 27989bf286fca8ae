"""Charts of estimates: every parameter with its interval beside the truth, and how well W distinguishes them."""

from collections.abc import Iterator, Sequence

import numpy as np
import numpy.typing as npt

from idbench.experiments.identification.fit import Fit
from idbench.experiments.recording.chart import NARROW, SQUARE, SYMBOLS, Chart
from idbench.experiments.recording.columns import part
from idbench.experiments.recording.scales import Signed, decades, linear, listed
from idbench.experiments.recording.stream import Stream
from idbench.experiments.style import GREY, SIGMAS, model_color
from idbench.experiments.text import percentage
from idbench.identify import Array

MAX_ROWS = 13
"""Parameters of a single chart; more have a chart for each joint."""

ASIDE = 0.22
"""How far the models of a parameter stand apart, of its room."""


def send_parameters(stream: Stream, at: str, fit: Fit, number: int = 0) -> None:
    """Send every parameter's error, or its deviation from the first model's, in standard errors; and the singular values."""
    reference, unit = _reference(fit), next(iter(fit.estimates.values())).standard_errors
    relative = 100 * unit / np.where(reference == 0, np.nan, np.abs(reference))
    off = {form: (estimate.X - reference) / unit for form, estimate in fit.estimates.items()}
    reach = {form: SIGMAS * estimate.standard_errors / unit for form, estimate in fit.estimates.items()}
    scale = _scale(fit, [np.abs(off[form]) + reach[form] for form in off])
    for k, (title, members) in enumerate(_parts(fit, np.nan_to_num(relative, nan=np.inf))):
        names = [_label(fit.basis.names[p], relative[p]) for p in members]
        chart = Chart(stream, f"{at}/parameters/{k:02}/{part(title)}", scale, listed("", names), SQUARE)
        ends = np.array([-0.5, len(members) - 0.5])
        chart.line("true" if fit.truth else next(iter(fit.estimates)), np.zeros(2), ends, GREY, listed=False)
        for i, form in enumerate(fit.estimates):
            x, half = off[form][members], reach[form][members]
            y = np.arange(float(len(members))) + ASIDE * (i - (len(fit.estimates) - 1) / 2)
            color = model_color(form, number)
            chart.segments(form, np.stack([x - half, x + half], axis=1), np.stack([y, y], axis=1), color, 1.5)
            chart.marks(form, x, y, color, SYMBOLS[i % len(SYMBOLS)])
    _singular_values(stream, at, fit, number)


def _label(name: str, relative: float) -> str:
    """Return a parameter with its %sigma."""
    return f"{name} {percentage(relative)} %" if np.isfinite(relative) else f"{name} = 0"


def _parts(fit: Fit, relative: Array) -> Iterator[tuple[str, npt.NDArray[np.intp]]]:
    """Yield title and parameters of each chart: all of few; of many those of each joint, the least certain first."""
    every = np.arange(len(fit.basis.names))
    if len(every) <= MAX_ROWS:
        yield "all", every
        return
    joints = np.array([parameter.joint or 0 for parameter in fit.basis.parameters])
    for j in np.unique(joints):
        mine = every[joints == j]
        yield fit.robot_model.robot.joints[j], mine[np.argsort(-relative[mine], kind="stable")]


def _reference(fit: Fit) -> Array:
    """Return what estimates are compared with: the truth, or the first of them."""
    return np.array(list(fit.truth.values())) if fit.truth else next(iter(fit.estimates.values())).X


def _scale(fit: Fit, farthest: Sequence[Array]) -> Signed:
    """Return an axis for all parameters, in standard errors of the first model."""
    first, every = next(iter(fit.estimates)), np.concatenate(farthest)
    high = 1.3 * max(2 * SIGMAS, float(np.max(every, where=np.isfinite(every), initial=0.0)))
    what = "error" if fit.truth else f"difference from {first}"
    return Signed(f"{what} / sigma of {first}; bars: 2 sigma", -high, high, 1.0)


def _singular_values(stream: Stream, at: str, fit: Fit, number: int) -> None:
    """Send the singular values of W, over the largest; beyond the allowed conditions, parameters cannot be distinguished."""
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
