"""Charts of the residuals of an identification: over velocity and position, with the friction laws, and its spectrum."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from idbench.experiments.identification.fit import Fit
from idbench.experiments.judgement.warnings import WEAK
from idbench.experiments.recording.chart import MAX_ROWS, NARROW, SQUARE, SYMBOLS, Chart, in_charts
from idbench.experiments.recording.scales import Linear, Signed, decades, linear, listed, named
from idbench.experiments.recording.stream import Stream, part
from idbench.experiments.reports.friction_curves import (
    FRICTIONS,
    FrictionCurves,
    Spectrum,
    of_joints,
    residual_instants,
    spectra,
)
from idbench.experiments.text import GREY, JOINTS, SIGMAS, Color, model_color, percent_reach
from idbench.identify import Array, Instants, binned, cutoffs

TRUE = "true"  # Name of the friction that is known
LINEAR_UP_TO = 1e-3  # Difference [sigma] up to which the axis is linear


def send_iterations(stream: Stream, at: str, fit: Fit) -> None:
    """Send, of estimators that go on from round to round, how far each parameter is from the last, in its sigma."""
    for model, estimate in fit.estimates.items():
        path, names = np.array(estimate.path), estimate.names
        if len(path) <= 1:
            continue
        sigma = np.where(estimate.standard_errors > 0, estimate.standard_errors, 1.0)
        off, rounds = (path - estimate.X) / sigma, np.arange(float(len(path)))
        high = max(float(np.nanmax(np.abs(off))), 10 * LINEAR_UP_TO)
        scale = Signed("away from the last [sigma]", -1.3 * high, 1.3 * high, LINEAR_UP_TO)
        axis = named("round", list(map(str, range(len(path)))))
        for place, members in in_charts(names, len(JOINTS)):  # a colour each
            chart = Chart(stream, f"{at}/iterations/{model}/{place}", axis, scale, NARROW)
            for color, p in zip(JOINTS, members, strict=False):
                chart.line(names[p], rounds, off[:, p], color)
                chart.marks(f"{names[p]} ", rounds, off[:, p], color)


ASIDE = 0.22  # How far the models of a parameter stand apart, of its room


def send_parameters(stream: Stream, at: str, fit: Fit, number: int = 0) -> None:
    """Send every parameter's error, or its difference from the first model's, in % of its value; and the singular values."""
    reference = np.array(list(fit.truth.values())) if fit.truth else next(iter(fit.estimates.values())).X
    size = np.where(reference == 0, np.nan, np.abs(reference)) / 100
    off = {form: (estimate.X - reference) / size for form, estimate in fit.estimates.items()}
    reach = {form: SIGMAS * estimate.standard_errors / size for form, estimate in fit.estimates.items()}
    unsure = next(iter(reach.values())) > SIGMAS * 100 * WEAK
    what = "error" if fit.truth else f"difference from {fit.leading}"
    for k, (title, members) in enumerate(_parts(fit)):
        names = [f"{fit.basis.names[p]}{' = 0' if reference[p] == 0 else '?' * bool(unsure[p])}" for p in members]
        far = [np.where(unsure, np.nan, np.abs(off[form]) + reach[form])[members] for form in off]
        high = percent_reach(np.concatenate(far))  # what is beyond the ends of the axis lies there
        x_axis = Linear(f"{what} [% of the value]; bars: 95 %", -high, high)
        chart = Chart(stream, f"{at}/parameters/{k:02}/{part(title)}", x_axis, listed("", names), SQUARE)
        ends = np.array([-0.5, len(members) - 0.5])
        chart.line(TRUE if fit.truth else next(iter(fit.estimates)), np.zeros(2), ends, GREY, listed=False)
        for i, form in enumerate(fit.estimates):
            x, half = off[form][members], reach[form][members]
            y = np.arange(float(len(members))) + ASIDE * (i - (len(fit.estimates) - 1) / 2)
            color = model_color(form, number)
            chart.intervals(form, x - half, x + half, y, color, 1.5)
            chart.marks(form, x, y, color, SYMBOLS[i % len(SYMBOLS)])
    _singular_values(stream, at, fit, number)


def _parts(fit: Fit) -> Iterator[tuple[str, npt.NDArray[np.intp]]]:
    """Yield title and parameters of each chart: all of few; of many those of each joint."""
    every = np.array(fit.basis.without_random_effects)
    if len(every) <= MAX_ROWS:
        yield "all", every
        return
    joints = np.array([fit.basis.parameters[p].joint or 0 for p in every])
    for j in np.unique(joints):
        yield fit.robot_model.robot.joints[j], every[joints == j]


def _singular_values(stream: Stream, at: str, fit: Fit, number: int) -> None:
    """Send the singular values of W, over the largest; beyond the allowed conditions, parameters cannot be distinguished."""
    factors = {form: estimate.problem.factors.together.R_W for form, estimate in fit.estimates.items()}
    shares = {form: (s := np.linalg.svd(R, compute_uv=False)) / s[0] for form, R in factors.items()}
    numbers = np.arange(1.0, 1 + len(fit.basis.names))
    x, y = linear("number", numbers), decades("over the largest", *shares.values())
    chart = Chart(stream, f"{at}/singular_values", x, y, NARROW)
    for i, (form, share) in enumerate(shares.items()):
        chart.marks(form, numbers, share, model_color(form, number), SYMBOLS[i % len(SYMBOLS)])
        chart.line(f"{form}: {1 / share[-1]:.3g}", numbers, share, model_color(form, number))


BINS = {"over_velocity": 41, "over_position": 240}  # Bins of residuals: over position fine enough for a motor of many slots
FEWEST = 5  # Samples from which on a bin has a mean
DOTS = 2500  # Dots of a chart: more would only hide each other
FAINTEST = 1e-3  # What a spectrum shows, as a share of its highest value
DARK: Color = (90, 90, 90)  # What the mask leaves out


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
        left = residual_instants(self.fit, self.fit.estimates)
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
            rows = {form: self._curves[form].rows(j) for form in left}
            points = {form: (v, residual, weight) for form, (v, residual, _, weight) in rows.items()}
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
        curves = {name: each for name, each in self._curves.items() if name in (*left, TRUE)}
        v, _, torque, weight = curves[next(iter(left))].rows(j)
        laws = {name: list(each.laws(j)) for name, each in curves.items()}
        every = [curve for each in laws.values() for curve in each]
        y = linear(f"friction of {self.joints[j]} [{force}]", _around(np.concatenate([friction for _, friction in every])))
        x = linear(f"qd [{way}/s]", every[0][0])
        chart = Chart(self.stream, f"{self.at}/friction/{self.joints[j]}", x, y, NARROW)
        self._dots(chart, v, torque, weight, GREY)
        for name, each in laws.items():
            v, torque = (np.concatenate([np.append(x, np.nan) for x in xs]) for xs in zip(*each, strict=True))
            chart.line(name, v, torque, self._color(name), 2.5 if name == "explicit" else 1.2)

    @cached_property
    def _curves(self) -> dict[str, FrictionCurves]:
        """Friction by each estimate, and by the truth where that is known."""
        found = {form: estimate.X for form, estimate in self.fit.estimates.items()}
        if self.fit.truth is not None:
            found[TRUE] = np.array(list(self.fit.truth.values()))
        return {name: FrictionCurves(self.fit, X) for name, X in found.items()}

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


COLORS: dict[str, Color] = {TRUE: GREY, "torque noise": JOINTS[1], "position noise": JOINTS[0]}
