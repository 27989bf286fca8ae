"""Estimates as intervals in the rows of a table: each in its own unit, beside zero and what the robot's file says."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from idbench.experiments.identification.fit import Fit
from idbench.experiments.judgement.warnings import doubtful
from idbench.experiments.reports.figures import color_of
from idbench.experiments.text import SIGMAS, relative
from idbench.identify.tables import concise

WIDE, HIGH = 220.0, 14.0
"""Size of an interval's picture [px]."""


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
    """The standard parameters that are grouped in it."""
    link: str
    """The joint that it belongs to."""


def parameter_rows(fit: Fit) -> Iterator[ParameterRow]:
    """Yield the parameters, by link."""
    lead, marks = fit.estimates[fit.leading], doubtful(fit)[fit.leading]
    stated = fit.truth or {name: x for name, x in fit.robot_model.truth(fit.robot_model.robot).items() if x}
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
            _interval(fit, i, filed),
            made.get(parameter.name, ""),
            joints[parameter.joint] if parameter.joint is not None else "",
        )


def _interval(fit: Fit, i: int, filed: float | None) -> str:
    """Return the estimates of a parameter with their 95 % intervals, on a scale that holds the leading one."""
    X = np.array([estimate.X[i] for estimate in fit.estimates.values()])
    half = np.array([SIGMAS * estimate.standard_errors[i] for estimate in fit.estimates.values()])
    first = X[0]
    ends = [first - half[0], first + half[0], *([] if filed is None else [filed])]
    if min(abs(first), abs(first) - half[0]) < np.ptp(ends):  # zero would squeeze what is known well
        ends.append(0.0)
    room = 0.15 * (max(ends) - min(ends)) or 0.1 * abs(first) or 1.0
    low, high = min(ends) - room, max(ends) + room
    if not np.isfinite([low, high]).all():
        return ""

    def at(x: float) -> float:
        return float(np.clip(WIDE * (x - low) / (high - low), 0.0, WIDE))

    parts = [f'<svg class="interval" viewBox="0 0 {WIDE:g} {HIGH:g}">']
    if low < 0 < high:
        parts.append(f'<path d="M{at(0):.1f},0v{HIGH:g}" stroke="#bbb"/>')
    if filed is not None:
        parts.append(f'<path d="M{at(filed):.1f},1v{HIGH - 2:g}" stroke="#000" stroke-width="2"/>')
    for k, model in enumerate(fit.estimates):
        y = HIGH * (k + 1) / (len(X) + 1)
        color = color_of(model)
        if np.isfinite(X[k] + half[k]):
            parts.append(f'<path d="M{at(X[k] - half[k]):.1f},{y:.1f}H{at(X[k] + half[k]):.1f}" stroke="{color}"/>')
            parts.append(f'<circle cx="{at(X[k]):.1f}" cy="{y:.1f}" r="2" fill="{color}"/>')
    return "".join([*parts, "</svg>"])
