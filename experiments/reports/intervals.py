"""Estimates as intervals in the rows of a table, in % of their values on one axis, beside what the robot's file says."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from idbench.experiments.identification.fit import Fit
from idbench.experiments.judgement.warnings import WEAK, doubtful
from idbench.experiments.reports.figures import color_of
from idbench.experiments.text import SIGMAS, percent_reach, relative
from idbench.identify.arrays import TINY
from idbench.identify.tables import concise

WIDE, HIGH = 220.0, 14.0  # Size of an interval's picture [px]
ROUNDING = 1e-12  # Value of a file's parameter that is rounding of 0: those that are grouped are sums of products


@dataclass(frozen=True)
class ParameterRow:
    """A parameter in the table of a report."""

    name: str
    """What it is called."""
    value: str
    """Value with its standard error, and marks."""
    unit: str
    """Of the value."""
    percent: str
    """Standard error [%]."""
    filed: str
    """What the robot's file says, or the truth if that is known; empty if neither says it."""
    interval: str
    """The 95 % intervals of all models as SVG."""
    made_of: str
    """The standard parameters that are grouped in it; empty if it is one."""
    link: str
    """The joint that it belongs to."""


def parameter_rows(fit: Fit) -> Iterator[ParameterRow]:
    """Yield the parameters, by link."""
    lead, marks = fit.estimates[fit.leading], doubtful(fit)[fit.leading]
    filed_values = fit.robot_model.truth(fit.robot_model.robot)  # 0 is what files say of what they do not state, too
    stated = fit.truth or {name: x for name, x in filed_values.items() if abs(x) > ROUNDING}
    reach = interval_reach(fit)
    made, joints = fit.robot_model.grouping.groupings, fit.robot_model.robot.joints
    for i in fit.basis.without_random_effects:
        parameter = fit.basis.parameters[i]
        x, sigma = float(lead.X[i]), float(lead.standard_errors[i])
        filed = stated.get(parameter.name)
        yield ParameterRow(
            parameter.name,
            f"{concise(x, sigma)}{''.join(marks[i]).strip()}",
            parameter.unit,
            relative(x, sigma),
            "" if filed is None else f"{filed:.4g}",
            _interval(fit, i, filed, reach),
            "" if made.get(parameter.name) == parameter.name else made.get(parameter.name, ""),
            joints[parameter.joint] if parameter.joint is not None else "",
        )


def interval_reach(fit: Fit) -> float:
    """Return how far the axis of the intervals goes to either side [% of the values]."""
    lead = fit.estimates[fit.leading]
    return percent_reach(100 * SIGMAS * lead.standard_errors / np.maximum(np.abs(lead.X), TINY), 100 * SIGMAS * WEAK)


def _interval(fit: Fit, i: int, filed: float | None, reach: float) -> str:
    """Return the differences of a parameter's estimates from the leading one with their 95 % intervals, cut at the axis."""
    first = float(fit.estimates[fit.leading].X[i])
    if not (np.isfinite(first) and first):
        return ""

    def at(x: float) -> float:
        share = 100 * (x - first) / abs(first) if np.isfinite(x) else 0.0
        return float(np.clip(WIDE * (1 + share / reach) / 2, 0.0, WIDE))

    parts = [f'<svg class="interval" viewBox="0 0 {WIDE:g} {HIGH:g}">', f'<path d="M{WIDE / 2:g},0v{HIGH:g}" stroke="#bbb"/>']
    if filed is not None:
        parts.append(f'<path d="M{at(filed):.1f},1v{HIGH - 2:g}" stroke="#000" stroke-width="2"/>')
    for k, (model, estimate) in enumerate(fit.estimates.items()):
        x, half = float(estimate.X[i]), SIGMAS * float(estimate.standard_errors[i])
        y, color = HIGH * (k + 1) / (len(fit.estimates) + 1), color_of(model)
        if np.isfinite(x + half):
            parts.append(f'<path d="M{at(x - half):.1f},{y:.1f}H{at(x + half):.1f}" stroke="{color}"/>')
            parts.append(f'<circle cx="{at(x):.1f}" cy="{y:.1f}" r="2" fill="{color}"/>')
    return "".join([*parts, "</svg>"])
