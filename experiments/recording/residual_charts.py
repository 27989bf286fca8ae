"""Charts of the residuals of an identification: over velocity and position, with the friction laws, and its spectrum."""

from collections.abc import Mapping, Sequence
from dataclasses import astuple, dataclass

import numpy as np

from idbench.experiments.identification.fit import Fit
from idbench.experiments.recording.chart import NARROW, Chart
from idbench.experiments.recording.scales import decades, linear
from idbench.experiments.recording.stream import Stream
from idbench.experiments.reports.friction_curves import FRICTIONS, FrictionCurves
from idbench.experiments.reports.spectra import Spectrum, left_over, of_joints, spectra
from idbench.experiments.style import GREY, JOINTS, Color, model_color
from idbench.identify import Array, Instants, binned, cutoffs

BINS = {"over_velocity": 41, "over_position": 240}
"""Bins of residuals: over position fine enough for a motor of many slots."""

FEWEST = 5
"""Samples from which on a bin has a mean."""

DOTS = 2500
"""Dots of a chart: more would only hide each other."""

FAINTEST = 1e-3
"""What a spectrum shows, as a share of its highest value."""

DARK: Color = (90, 90, 90)
"""What the mask leaves out."""


@dataclass(frozen=True, eq=False)
class ResidualCharts:
    """The charts of one identification."""

    stream: Stream
    """Where they go."""
    at: str
    """Path of the identification."""
    fit: Fit
    """The identification."""
    joints: Sequence[str]
    """Names of the joints, as parts of paths."""
    number: int = 0
    """Which identification of the log it is, from 0: each has its own colours."""

    def send(self) -> None:
        """Send them all."""
        left = left_over(self.fit)
        joined = of_joints(self.fit, left)
        for j in range(len(self.joints)) if joined else ():
            self._over("over_velocity", j, joined)
            self._over("over_position", j, joined)
            self._friction(j, joined)
        for found in spectra(self.fit, left):
            self._spectrum(found)

    def _color(self, name: str) -> Color:
        return COLORS.get(name) or model_color(name, self.number)

    def _over(self, kind: str, j: int, left: Mapping[str, Instants]) -> None:
        """Send the residual over velocity or position: dots of the first model, and the mean of every one.

        Over velocity it is the residual of the rows: at every sample, noise of differentiated positions would hide a delay.
        Over position it is that of every sample: cogging may be faster than the band of the fit.
        """
        force, way = self.fit.robot_model.units(j)
        if kind == "over_velocity":
            points = {form: FrictionCurves(self.fit, self.fit.estimates[form].X).residual(j) for form in left}
        else:
            points = {f: (x.equations.signals.state.q[j, x.inner], x.residual[j], x.weight[j]) for f, x in left.items()}
        seen, residual, weight = next(iter(points.values()))
        x = linear(f"qd [{way}/s]" if kind == "over_velocity" else f"q [{way}]", seen)
        edges: Array = np.linspace(seen.min(), seen.max(), BINS[kind] + 1)
        enough = np.histogram(seen[weight > 0], edges)[0] >= FEWEST
        means = {form: np.where(enough, binned(seen, y, w, edges), np.nan) for form, (_, y, w) in points.items()}
        y = linear(f"residual of {self.joints[j]} [{force}]", _most(residual[weight > 0]), *means.values())
        chart = Chart(self.stream, f"{self.at}/{kind}/{self.joints[j]}", x, y, NARROW)
        self._dots(chart, seen, residual, weight, GREY)
        for form, mean in means.items():
            width = 2.5 if form == next(iter(left)) else 1.2  # models may agree: what is below shows
            chart.line(f"mean, {form}", (edges[1:] + edges[:-1]) / 2, mean, self._color(form), width)

    def _dots(self, chart: Chart, x: Array, y: Array, weight: Array, color: Color) -> None:
        some = np.arange(len(x)) % max(1, len(x) // DOTS) == 0
        for name, which, shade in (("masked", weight == 0, DARK), ("used", weight > 0, color)):
            if (shown := some & which).any():
                chart.dots(name, x[shown], y[shown], shade)
                chart.list_entry(name, shade)

    def _friction(self, j: int, left: Mapping[str, Instants]) -> None:
        """Send the torque minus that of the rigid body, over velocity, the laws that were found, and the true one."""
        if not any(p.kind in FRICTIONS and p.joint == j for p in self.fit.basis.parameters):
            return
        force, way = self.fit.robot_model.units(j)
        found = {form: self.fit.estimates[form].X for form in left}
        if self.fit.truth is not None:
            found["true"] = np.array(list(self.fit.truth.values()))
        curves = {name: FrictionCurves(self.fit, X) for name, X in found.items()}
        dots = curves[next(iter(left))].measured(j)
        laws = {name: list(each.laws(j)) for name, each in curves.items()}
        every = [curve for each in laws.values() for curve in each]
        y = linear(f"friction of {self.joints[j]} [{force}]", _around(np.concatenate([curve.torque for curve in every])))
        x = linear(f"qd [{way}/s]", every[0].v)
        chart = Chart(self.stream, f"{self.at}/friction/{self.joints[j]}", x, y, NARROW)
        self._dots(chart, *dots, GREY)
        for name, each in laws.items():
            v, torque = (np.concatenate([np.append(x, np.nan) for x in xs]) for xs in zip(*map(astuple, each), strict=True))
            chart.line(name, v, torque, self._color(name), 2.5 if name == "explicit" else 1.2)

    def _spectrum(self, found: Spectrum) -> None:
        """Send spectra of the residuals of a row, the prediction from the estimated noise, and the cut-offs of the chain."""
        models = [density for name, density in found.lines.items() if name not in COLORS]
        shown = [np.maximum(density, FAINTEST * max(x.max() for x in models)) for density in found.lines.values()]
        y = decades(f"residual of {found.row} [{found.unit}/√Hz]", *shown)
        row = found.row if found.joint is None else self.joints[found.joint]
        chart = Chart(self.stream, f"{self.at}/spectrum/{row}", decades("f [Hz]", found.f), y)
        for name, density in found.lines.items():
            chart.line(name, found.f, density, self._color(name), 2.5 if name == "explicit" else 1.2)
        for name, cutoff in cutoffs(self.fit.processing, self.fit.logs.fitted[0].fs).items():
            chart.line(f"cut-off {name}", np.full(2, cutoff), np.array([y.low, y.high]), DARK)


def _around(x: Array) -> Array:
    """Return the ends of an axis on which a law fills the middle third: dots beyond it are noise that would hide it."""
    low, high = float(np.nanmin(x)), float(np.nanmax(x))
    return np.array([low, high]) + (high - low) * np.array([-1.0, 1.0])


def _most(x: Array) -> Array:
    """Return between which values nine of ten lie, with some room, so that wild ones do not set the scale."""
    low, high = np.quantile(x, [0.05, 0.95]) if len(x) else np.zeros(2)
    return np.array([low, high]) + 0.5 * (high - low) * np.array([-1.0, 1.0])


COLORS: dict[str, Color] = {"true": GREY, "torque noise": JOINTS[1], "position noise": JOINTS[0]}
