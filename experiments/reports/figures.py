"""Figures of an identification's report."""

from importlib.resources import files
from typing import Any

import numpy as np
from jinja2 import Environment

from idbench.experiments.identification.fit import Fit
from idbench.experiments.judgement.held_out import HeldOut
from idbench.experiments.reports.estimates import all_units
from idbench.experiments.reports.friction_curves import FRICTIONS, WHOLE, FrictionCurves, residual_instants, spectra
from idbench.experiments.reports.panels import Panel, PanelAxis, figure
from idbench.experiments.text import model_color, percentage
from idbench.identify import cutoffs
from idbench.identify.arrays import TINY


def rendered(package: str, template: str, **words: Any) -> str:
    """Return the page that a template of a package makes of `words`; it needs no other file."""
    page = Environment(autoescape=True, trim_blocks=True).from_string(_text(package, template))
    return page.render(style=_text("idbench.experiments.reports", "report.css"), **words)


def _text(package: str, name: str) -> str:
    return files(package).joinpath(name).read_text(encoding="utf-8")


NOISES = {"torque noise": ("#808080", "5 3"), "position noise": ("#8c564b", "1.5 3")}
"""How the noise that was found is drawn: color, dashes."""


def torques_figure(one: HeldOut) -> str:
    """Return measured and predicted torques on a held-out log, joint by joint."""
    rows, models = one.problem.rows, list(one.torques)
    panels = list[Panel]()
    for j, joint in enumerate(one.fit.robot_model.robot.joints):
        own, validation = rows.group == j, one.torques[models[0]]
        force, _ = one.fit.robot_model.units(j)
        panel = Panel(f"{joint}: {validation.rms[j]:.2g} {force} off, {percentage(validation.percent[j])} %")
        panel.line(rows.time[own], np.where(rows.valid[own], rows.Y[own], np.nan), "#8c8c8c", 2.4, "measured")
        for model in reversed(models):
            predicted = rows.predicted(one.fit.estimates[model].X)
            panel.line(rows.time[own], np.where(rows.valid[own], predicted[own], np.nan), color_of(model), 1.0, model)
        panels.append(panel)
    return figure(panels, 1.5, "time [s]", f"torque [{all_units(one.fit.robot_model)[0]}]")


def residuals_figure(one: HeldOut) -> str:
    """Return the residual torques of the first model on a held-out log over time, joint by joint, with the noise of the log."""
    rows, model = one.problem.rows, next(iter(one.torques))
    panels = list[Panel]()
    residual = rows.Y - rows.predicted(one.fit.estimates[model].X)
    for j, joint in enumerate(one.fit.robot_model.robot.joints):
        own, panel = rows.group == j, Panel(joint)
        panel.line(rows.time[own], np.where(rows.valid[own], residual[own], np.nan), color_of(model), 0.8)
        panels.append(panel)
    return figure(panels, 1.35, "time [s]", f"residual [{all_units(one.fit.robot_model)[0]}]")


def causes_figure(fit: Fit) -> str:
    """Return residuals of the fit where each mistake that they show explains most of them, and what it explains."""
    if not (every := [(cause, x) for cause in fit.diagnosis or () if (x := cause.suspect.explained) is not None]):
        return ""
    rows, X = fit.problem.explicit.rows, fit.estimates[fit.leading].X
    residual, panels = rows.Y - rows.predicted(X), list[Panel]()
    for cause, explained in every:
        squares, of_all = (np.sum(rows.by_kind(x * rows.valid) ** 2, axis=-1) for x in (explained, rows.Y))
        own = rows.group == int(np.argmax(squares / np.maximum(of_all, TINY)))  # of the joint where it explains most
        time = np.arange(np.count_nonzero(own)) * np.median(np.diff(rows.time[own]))  # of several logs, one after the other
        shown = fit.robot_model.robot.joints[int(rows.group[own][0])]
        panel = Panel(f"{shown}: {cause.short}{f', of {cause.joint}' if cause.joint not in (None, shown) else ''}")
        for values, color, label in ((residual, "#999999", "residual of the fit"), (explained, color_of("power"), "explained")):
            panel.line(time, np.where(rows.valid[own], values[own], np.nan), color, 1.2, label)
        panels.append(panel)
    return figure(panels, 1.6, "time [s]", f"[{all_units(fit.robot_model)[0]}]")


def friction_figure(fit: Fit) -> str:
    """Return friction over velocity: what the rigid body leaves of the torque, and the estimated law.

    Beyond the speeds of the log the law is dotted. One that grows with the load is drawn at the smallest and the largest load.
    """
    estimate = fit.estimates[next(iter(fit.estimates))]
    if not any(p.kind in FRICTIONS for p in fit.basis.parameters):
        return ""
    curves, panels = FrictionCurves(fit, estimate.X), list[Panel]()
    for j, joint in enumerate(fit.robot_model.robot.joints):
        v, _, torque, weight = curves.rows(j)
        v, torque = v[weight > WHOLE], torque[weight > WHOLE]
        panel = Panel(f"{joint}: {' + '.join(fit.robot_model.laws.names[j])}")
        for number, (speeds, friction) in enumerate(curves.laws(j)):
            inside = (speeds >= v.min(initial=0.0)) & (speeds <= v.max(initial=0.0))
            labels = ("", "") if number else ("estimated law", "beyond the speeds of the log")
            panel.line(speeds, np.where(inside, friction, np.nan), color_of("explicit"), 1.6, labels[0])
            panel.line(speeds, np.where(inside, np.nan, friction), color_of("power"), 1.6, labels[1], "2 3")
        panel.dots(v, torque, "#777777", 0.8, "torque minus that of the links")  # in front of lines, which would hide them
        panels.append(panel)
    force, ways = all_units(fit.robot_model)
    return figure(panels, 1.6, f"velocity [{ways.replace(',', '/s,')}/s]", f"friction [{force}]")


def spectra_figure(fit: Fit) -> str:
    """Return spectra of what the first model leaves, and of the noise that was found, joint by joint; of the first log."""
    form = next(iter(fit.estimates))
    if fit.logs.fitted[0].poses:  # rows by themselves, of which there is no spectrum
        return ""
    every = [found for found in spectra(fit, residual_instants(fit, [form])) if found.lines[form].max()]  # of joints that move
    panels = list[Panel]()
    for found in every:
        top = float(found.lines[form].max())
        ends = top * 1e-5, top * 3
        panel = Panel(f"{found.row} [{found.unit}/\u221aHz]", PanelAxis(log=True), PanelAxis(log=True, limits=ends))
        for name, density in found.lines.items():
            color, dash = NOISES.get(name, (color_of(form), ""))
            panel.line(found.f, density, color, 1.0, "residual" if name == form else name, dash)
        for cutoff in cutoffs(fit.processing, fit.logs.fitted[0].fs).values():
            panel.line(np.array([cutoff, cutoff]), np.array(ends), "#cccccc")
        panels.append(panel)
    return figure(panels, 1.6, "frequency [Hz]")


def color_of(model: str) -> str:
    """Return the colour of a model for pages."""
    return "#{:02x}{:02x}{:02x}".format(*model_color(model)[:3])
