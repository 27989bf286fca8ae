"""The report of an identification: one HTML file that needs no other."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from datetime import date
from importlib.metadata import version
from itertools import groupby
from math import isfinite
from operator import itemgetter
from typing import Any

import numpy as np

from idbench.experiments.document import Conclusion
from idbench.experiments.identification.fit import Fit
from idbench.experiments.judgement.held_out import HeldOut
from idbench.experiments.judgement.judgement import Judgement, Unjudged
from idbench.experiments.judgement.warnings import WEAK, doubtful
from idbench.experiments.reports.estimates import EstimatesTable, all_units, correlated, error_shares
from idbench.experiments.reports.figures import (
    causes_figure,
    color_of,
    friction_figure,
    rendered,
    residuals_figure,
    spectra_figure,
    torques_figure,
)
from idbench.experiments.results.attempts import Attempts
from idbench.experiments.text import SIGMAS, percent_reach, percentage, relative
from idbench.identify.arrays import TINY
from idbench.identify.noise.linearization import smoothed
from idbench.identify.tables import concise

WIDE, HIGH = 220.0, 14.0  # Size of an interval's picture [px]
ROUNDING = 1e-12  # Value of a file's parameter that is rounding of 0: those that are grouped are sums of products


def parameter_rows(fit: Fit) -> Iterator[dict[str, str]]:
    """Yield the parameters by link, as the table of the page names their cells."""
    lead, marks = fit.estimates[fit.leading], doubtful(fit)[fit.leading]
    filed_values = fit.robot_model.truth(fit.robot_model.robot)  # 0 is what files say of what they do not state, too
    stated = fit.truth or {name: x for name, x in filed_values.items() if abs(x) > ROUNDING}
    reach = interval_reach(fit)
    made, joints = fit.robot_model.grouping.groupings, fit.robot_model.robot.joints
    places = {i: fit.basis.parameters[i] for i in fit.basis.without_random_effects}
    for i, parameter in sorted(places.items(), key=lambda of: len(joints) if of[1].joint is None else of[1].joint):
        x, sigma = float(lead.X[i]), float(lead.standard_errors[i])
        filed = stated.get(parameter.name)
        yield {
            "name": parameter.name,
            "value": f"{concise(x, sigma)}{''.join(marks[i]).strip()}",
            "unit": parameter.unit,
            "percent": relative(x, sigma),
            "filed": "" if filed is None else f"{filed:.4g}",  # or the truth if that is known; empty if neither says it
            "interval": _interval(fit, i, filed, reach),
            "made_of": "" if made.get(parameter.name) == parameter.name else made.get(parameter.name, ""),
            "link": joints[parameter.joint] if parameter.joint is not None else "",
        }


def interval_reach(fit: Fit) -> float:
    """Half width of the intervals' axis [% of the values]."""
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


LONGEST = 20  # Correlations that are listed, the strongest ones


def report(
    judgement: Judgement,
    answer: Conclusion,
    warnings: Mapping[str, Sequence[str]],
    notes: Sequence[str],
    command: str,
    attempts: Attempts,
) -> str:
    """Return the page: whether to trust it, what to check, torques, parameters, friction, residuals, logs, the command.

    A figure that fails is noted in `attempts`, and missing.
    """
    fit, robot_model = judgement.fit, judgement.fit.robot_model
    lead = fit.estimates[fit.leading]
    hardest = judgement.hardest
    alike = {} if hardest is None else hardest.alike
    cutoff = fit.processing.cutoff
    return rendered(
        "idbench.experiments.reports",
        "identify.html.j2",
        title=f"{robot_model.tree.name}: {fit.logs.title}",
        subtitle=f"{robot_model.tree.n} joints, {len(fit.basis.names)} parameters, {fit.request.method.estimator_name}",
        warnings={about: messages for about, messages in warnings.items() if messages},
        answer=answer,
        verdicts=[(f"{' and '.join(of)} model{'s' * (len(of) > 1)}", *verdict) for verdict, of in alike.items()],
        unjudged="; ".join(one.why for one in judgement.on if isinstance(one, Unjudged)),
        failures=fit.failures,
        unseen=[_held_out(one, attempts) for one in judgement.held_out],
        torque_limits=[] if hardest is None else list(_torque_errors(hardest)),
        models=[(model, color_of(model)) for model in fit.estimates],
        leading=fit.leading,
        filed="true value" if fit.truth else "robot's file",
        reach=f"{interval_reach(fit):.2g}",
        parameters=[(link, list(rows)) for link, rows in groupby(parameter_rows(fit), itemgetter("link"))],
        legend=EstimatesTable(fit, (fit.leading,)).legend,
        correlated=correlated(lead)[:LONGEST],
        limits=[(cause, percentage(share), name, percentage(most)) for cause, share, name, most in error_shares(lead)],
        causes=_figure(attempts, "causes", lambda: causes_figure(fit)),
        friction=_figure(attempts, "friction", lambda: friction_figure(fit)),
        spectra=_figure(attempts, "spectra", lambda: spectra_figure(fit)),
        joints=robot_model.robot.joints,
        force=all_units(robot_model)[0],
        logs=list(_logs(fit)),
        ranges=list(_ranges(fit)),
        notes=notes,
        command=command,
        today=date.today().isoformat(),
        version=version("idbench"),
        robot=robot_model.name,
        chain=fit.request.method.chain_name,
        cutoff="" if cutoff is None else f"{cutoff:g} Hz",
        estimator=fit.request.method.estimator_name,
    )


def _figure(attempts: Attempts, name: str, draw: Callable[[], str]) -> str:
    """Return a figure, or nothing if it fails."""
    return attempts.attempt(f"the figure of {name} in report.html", draw) or ""


def _held_out(one: HeldOut, attempts: Attempts) -> tuple[str, str, str, list[str], list[list[str]]]:
    """Return title, figures of torques and residuals, and table of a held-out log."""
    torques = one.torques
    heads = ["rms of the torque", *(f"{model} {what}" for model in torques for what in ("rms", "%", "R2"))]
    rows = []
    for j, joint in enumerate(one.fit.robot_model.robot.joints):
        first = next(iter(torques.values()))
        cells = [cell for v in torques.values() for cell in (f"{v.rms[j]:.3g}", percentage(v.percent[j]), f"{v.R2[j]:.4f}")]
        rows.append([joint, f"{first.level[j]:.3g}", *cells])
    moved = _figure(attempts, "torques", lambda: torques_figure(one))
    residuals = _figure(attempts, "residuals", lambda: residuals_figure(one))
    return one.title, moved, residuals, heads, rows


def _torque_errors(one: HeldOut) -> Iterator[list[str]]:
    """Yield, of each joint, the rms torque error on a held-out log, and what of it is noise, sigma, the model."""
    found = one.torques[one.fit.leading]
    for j, joint in enumerate(one.fit.robot_model.robot.joints):
        parts = (found.rms[j], found.noise[j], found.open[j], found.excess[j])
        unit = one.fit.robot_model.units(j)[0]
        yield [joint, unit, *(f"{x:.2g}" if isfinite(x) else "" for x in parts), percentage(found.percent[j])]


def _ranges(fit: Fit) -> Iterator[list[str]]:
    """Yield, by joint, the largest speeds, accelerations and torques of the fitted logs without their noise: where it holds."""
    n, missing = fit.basis.n, {j for log in fit.logs.fitted for j in log.missing}
    largest = np.zeros((3, n))
    for signals in fit.problem.signals:
        grid = fit.problem.own_chain.grid(signals.log)
        inner, state = slice(grid.first, grid.first + grid.step * grid.count), signals.state
        slow = (smoothed(x, signals.fs)[..., inner] for x in (state.qd, state.qdd, signals.torque.mean))
        largest = np.maximum(largest, [np.abs(x).max(axis=-1) for x in slow])
    for j, joint in enumerate(fit.robot_model.robot.joints):
        torque, position = fit.robot_model.units(j)
        each = [f"{x:.3g} {unit}" for x, unit in zip(largest[:, j], (f"{position}/s", f"{position}/s^2", torque), strict=True)]
        yield [joint, *each[:2], "not logged" if j in missing else each[2]]


def _logs(fit: Fit) -> Iterator[list[Any]]:
    errors = next(iter(fit.torque_errors.values()), None)
    for k, log in enumerate(fit.logs.fitted):
        torque = f"{log.torque.meaning}, delay {log.torque.late}"
        left = [] if errors is None else [f"{x:.2g}" for x in errors[k]]
        yield [fit.logs.name(k), f"{log.fs:.5g}", f"{log.samples / log.fs:.4g}", torque, *left]
