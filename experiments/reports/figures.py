"""Figures of an identification's report."""

from collections.abc import Sequence
from importlib.resources import files
from io import StringIO
from typing import Any

import matplotlib as mpl
import numpy as np
import numpy.typing as npt
from jinja2 import Environment
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from idbench.experiments.identification.fit import Fit
from idbench.experiments.judgement.held_out import HeldOut
from idbench.experiments.reports.friction_curves import FRICTIONS, WHOLE, FrictionCurves, left_over, spectra
from idbench.experiments.text import SIGMAS, model_color, percentage
from idbench.identify import Array, cutoffs

mpl.rcParams.update({"svg.hashsalt": "idbench", "svg.fonttype": "none", "font.size": 8, "axes.grid": True, "grid.alpha": 0.3})


def rendered(package: str, template: str, **words: Any) -> str:
    """Return the page that a template of a package makes of `words`; it needs no other file."""
    page = Environment(autoescape=True, trim_blocks=True).from_string(_text(package, template))
    return page.render(style=_text("idbench.experiments.reports", "report.css"), **words)


def svg(figure: Figure) -> str:
    """Return a figure as SVG, the same bytes for the same figure."""
    text = StringIO()
    figure.savefig(text, format="svg", metadata={"Date": None})
    return text.getvalue()[text.getvalue().index("<svg") :]


def _text(package: str, name: str) -> str:
    return files(package).joinpath(name).read_text(encoding="utf-8")


NOISES: dict[str, dict[str, Any]] = {
    "torque noise": {"color": "0.5", "lw": 1.0, "ls": "--"},
    "position noise": {"color": "tab:brown", "lw": 1.0, "ls": ":"},
}
"""How the noise that was found is drawn."""

WIDTH = 11.0
"""Of figures [inch]."""

FEW = 2
"""Joints from which on panels stand in two columns."""

ACROSS, FEW_NAMES = 30, 18
"""Names of parameters that have room beside each other, upright and level."""

OUTSIDE = 1e6
"""Per cent of a parameter's value beyond which it is drawn no farther: a friction that was moved to zero has none."""


def torques_figure(one: HeldOut) -> str:
    """Return measured and predicted torques on a held-out log, joint by joint."""
    rows = one.problem.rows
    figure, panels = _panels(rows.kinds, 1.5)
    models = list(one.torques)
    for j, panel in enumerate(panels):
        own = rows.group == j
        shown = np.where(rows.valid[own], rows.Y[own], np.nan)
        panel.plot(rows.time[own], shown, color="0.55", lw=2.4, label="measured")
        for model in reversed(models):
            X = one.fit.estimates[model].X
            predicted = np.where(rows.valid[own], rows.predicted(X)[own], np.nan)
            panel.plot(rows.time[own], predicted, color=_color(model), lw=1.0, label=model)
        validation = one.torques[models[0]]
        joint, (force, _) = one.fit.robot_model.robot.joints[j], one.fit.robot_model.units(j)
        panel.set_title(f"{joint}: {validation.rms[j]:.2g} {force} off, {percentage(validation.percent[j])} %", loc="left")
    _last(panels, "time [s]", f"torque [{_units(one.fit)[0]}]")
    _legend(figure, panels[0])
    return svg(figure)


def residuals_figure(one: HeldOut) -> str:
    """Return the residual torques of the first model on a held-out log over time, joint by joint, with the noise of the log."""
    rows, model = one.problem.rows, next(iter(one.torques))
    figure, panels = _panels(rows.kinds, 1.35)
    residual = rows.Y - rows.predicted(one.fit.estimates[model].X)
    for j, panel in enumerate(panels):
        own = rows.group == j
        shown = np.where(rows.valid[own], residual[own], np.nan)
        panel.axhline(0.0, color="0.8", lw=0.8)
        panel.plot(rows.time[own], shown, color=_color(model), lw=0.8)
        panel.set_title(one.fit.robot_model.robot.joints[j], loc="left")
    _last(panels, "time [s]", f"residual [{_units(one.fit)[0]}]")
    return svg(figure)


def _share(x: Array, size: Array) -> Array:
    """Return x in per cent of a size, far outside of the picture where that is next to nothing."""
    return np.clip(100 * x / size, -OUTSIDE, OUTSIDE)


def parameters_figure(fit: Fit) -> str:
    """Return estimates with intervals, over the size of each: those of the first model, and how others differ."""
    shown = fit.basis.without_random_effects
    lines = -(-len(shown) // ACROSS)  # names that would run together go on in another panel
    figure, panels = _panels(lines, 2.4, columns=1)
    for panel, members in zip(panels, np.array_split(np.array(shown), lines), strict=True):
        _parameters_panel(panel, fit, members)
    _legend(figure, panels[0])
    return svg(figure)


def _parameters_panel(panel: Axes, fit: Fit, members: npt.NDArray[np.intp]) -> None:
    names, models = [fit.basis.names[p] for p in members], list(fit.estimates)
    leading = fit.estimates[models[0]].X[members]
    size = np.maximum(np.abs(leading), 1e-300)
    at = np.arange(len(names))
    for i, model in enumerate(models):
        estimate = fit.estimates[model]
        off, half = _share(estimate.X[members] - leading, size), _share(SIGMAS * estimate.standard_errors[members], size)
        x = at + 0.22 * (i - (len(models) - 1) / 2)
        panel.errorbar(x, off, half, fmt="o", ms=2.5, lw=1.2, color=_color(model), label=model)
    if fit.truth is not None:
        true = np.array(list(fit.truth.values()))[members]
        panel.plot(at, _share(true - leading, size), "_", ms=9, color="black", label="true")
    panel.set_yscale("symlog", linthresh=1.0, linscale=0.6)
    panel.set_ylim(-300, 300)
    panel.set_yticks([-100, -10, -1, 0, 1, 10, 100], ["-100", "-10", "-1", "0", "1", "10", "100"])
    panel.set_xticks(at, names, rotation=90 if len(names) > FEW_NAMES else 0, fontsize=7)
    panel.set_xlim(-1, len(names))
    panel.set_ylabel(f"difference from {models[0]}, with\n95 % interval [% of its value]")


def friction_figure(fit: Fit) -> str:
    """Return friction over velocity: what the rigid body leaves of the torque, and the estimated law.

    Beyond the speeds of the log the law is dotted. One that grows with the load is drawn at the smallest and the largest load.
    """
    estimate = fit.estimates[next(iter(fit.estimates))]
    if not any(p.kind in FRICTIONS for p in fit.basis.parameters):
        return ""
    curves = FrictionCurves(fit, estimate.X)
    figure, panels = _panels(fit.basis.n, 1.6)
    for j, panel in enumerate(panels):
        v, torque, weight = curves.measured(j)
        v, torque = v[weight > WHOLE], torque[weight > WHOLE]
        panel.plot(v, torque, ".", ms=2, color="0.6", label="torque minus that of the links")
        for number, line in enumerate(curves.laws(j)):
            inside = np.abs(line.v) <= np.abs(v).max(initial=0.0)
            label = "estimated law" if number == 0 else None
            panel.plot(line.v[inside], line.torque[inside], color=_color("explicit"), lw=1.6, label=label)
            beyond = np.where(inside, np.nan, line.torque)
            panel.plot(line.v, beyond, ":", color=_color("power"), lw=1.6, label=label and "beyond the speeds of the log")
        panel.set_title(f"{fit.robot_model.robot.joints[j]}: {' + '.join(fit.robot_model.laws.names[j])}", loc="left")
    force, velocity = _units(fit)
    _last(panels, f"velocity [{velocity}]", f"friction [{force}]")
    _legend(figure, panels[0])
    return svg(figure)


def spectra_figure(fit: Fit) -> str:
    """Return spectra of what the first model leaves, and of the noise that was found, joint by joint; of the first log."""
    form = next(iter(fit.estimates))
    every = [found for found in spectra(fit, {form: left_over(fit)[form]}) if found.lines[form].max()]  # of joints that move
    figure, panels = _panels(len(every), 1.6)
    for panel, found in zip(panels, every, strict=True):
        panel.set_title(f"{found.row} [{found.unit}/√Hz]", loc="left")
        for name, density in found.lines.items():
            panel.plot(
                found.f, density, label="residual" if name == form else name, **NOISES.get(name, {"color": _color(form)})
            )
        for cutoff in cutoffs(fit.processing, fit.logs.fitted[0].fs).values():
            panel.axvline(cutoff, color="0.8", lw=1.0)
        top = found.lines[form].max()
        panel.set_xscale("log")
        panel.set_yscale("log")
        panel.set_ylim(top * 1e-5, top * 3)
        panel.minorticks_off()
    _last(panels, "frequency [Hz]", "")
    _legend(figure, panels[0])
    return svg(figure)


def _units(fit: Fit) -> tuple[str, str]:
    """Return the units of the torques and velocities of all joints: those of slides stand beside those of hinges."""
    each = [fit.robot_model.units(j) for j in range(fit.basis.n)]
    return ", ".join(dict.fromkeys(force for force, _ in each)), ", ".join(dict.fromkeys(f"{way}/s" for _, way in each))


def _panels(count: int, height: float, columns: int = 0) -> tuple[Figure, list[Axes]]:
    """Return a figure with a panel each, in two columns if there are many and no number of columns is given."""
    columns = columns or (2 if count > FEW else 1)
    lines = -(-count // columns)
    whole = height * lines + 0.5
    figure = Figure(figsize=(WIDTH, whole))
    panels = list(np.atleast_1d(figure.subplots(lines, columns)).ravel())
    # By hand: a layout that is solved for draws everything twice.
    left = 0.75 / WIDTH
    right = 1 - 0.1 / WIDTH
    bottom = 0.5 / whole
    top = 1 - 0.5 / whole
    figure.subplots_adjust(left, bottom, right, top, wspace=0.15, hspace=0.42)
    for panel in panels[count:]:
        panel.set_visible(False)
    return figure, panels[:count]


def _last(panels: Sequence[Axes], x: str, y: str) -> None:
    for panel in panels[-2:]:
        panel.set_xlabel(x)
    for panel in panels[:: 2 if len(panels) > FEW else 1]:
        panel.set_ylabel(y)


def _legend(figure: Figure, panel: Axes) -> None:
    handles, labels = panel.get_legend_handles_labels()
    figure.legend(handles, labels, loc="upper right", ncols=8, frameon=False)


def _color(model: str) -> Array:
    return np.array(model_color(model))[:3] / 255
