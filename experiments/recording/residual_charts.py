"""Charts of what an identification leaves over: over velocity and position, with the friction laws, and its spectrum."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from experiments.identification.fit import Fit
from experiments.recording.chart import NARROW, Chart
from experiments.recording.scales import decades, linear
from experiments.recording.stream import Stream
from experiments.reports.friction_curves import FRICTIONS
from experiments.style import GREY, JOINTS, Color, model_color
from identify import MODELS, Array, Estimate, Instants, binned, cutoffs, instants, noise_spectra, spectrum

BINS = {"over_velocity": 41, "over_position": 240}
"""Bins of residuals: over position fine enough for a motor of many slots."""

FEWEST = 5
"""Samples from which on a bin has a mean."""

DOTS = 2500
"""Dots of a chart: more would only hide each other."""

LAW = 400
"""Points of the curve of a friction law."""

RESOLUTION = 0.5
"""Distance of the frequencies of a spectrum [Hz]."""

FAINTEST = 1e-3
"""What a spectrum shows, as a share of its highest value."""

DARK: Color = (90, 90, 90)
"""What the mask leaves out."""


@dataclass(frozen=True, eq=False)
class ResidualCharts:
    """The charts of one identification.

    Parameters
    ----------
    stream : Stream
        Where they go.
    at : str
        Path of the identification.
    fit : Fit
        The identification.
    joints : sequence of str
        Names of the joints, as parts of paths.
    number : int
        Which identification of the log it is, from 0: each has its own colours.
    """

    stream: Stream
    at: str
    fit: Fit
    joints: Sequence[str]
    number: int = 0

    def send(self) -> None:
        """Send them all."""
        left = {form: self._instants(form, estimate) for form, estimate in self.fit.estimates.items()}
        of_joints = {form: one for form, one in left.items() if form != "power" and len(one.residual) == len(self.joints)}
        for j in range(len(self.joints)) if of_joints else ():
            self._over("over_velocity", j, of_joints)
            self._over("over_position", j, of_joints)
            self._friction(j, of_joints)
            self._spectrum(self.joints[j], j, of_joints)
        for form in left.keys() - of_joints.keys():
            self._spectrum(form, 0, {form: left[form]})

    def _color(self, name: str) -> Color:
        return COLORS.get(name) or model_color(name, self.number)

    def _instants(self, form: str, estimate: Estimate) -> Instants:
        return instants(self.fit.problem.signals[0], self.fit.basis, MODELS.create(form), self.fit.processing, estimate.X)

    def _units(self, j: int) -> tuple[str, str]:
        """Return the units of a joint's torque and position."""
        return ("N", "m") if self.fit.subject.tree.joints[j].kind == "slide" else ("N m", "rad")

    def _state(self, kind: str, j: int, left: Instants) -> Array:
        state = left.equations.signals.state
        return (state.qd if kind == "over_velocity" else state.q)[j, left.inner]

    def _over(self, kind: str, j: int, left: Mapping[str, Instants]) -> None:
        """Send the residual over velocity or position: dots of the first model, and the mean of every one."""
        force, way = self._units(j)
        leading = next(iter(left.values()))
        seen, weight = self._state(kind, j, leading), leading.weight[j]
        x = linear(f"qd [{way}/s]" if kind == "over_velocity" else f"q [{way}]", seen)
        edges: Array = np.linspace(seen.min(), seen.max(), BINS[kind] + 1)
        enough = np.histogram(seen[weight > 0], edges)[0] >= FEWEST
        means = {
            form: np.where(enough, binned(seen, one.residual[j], one.weight[j], edges), np.nan) for form, one in left.items()
        }
        y = linear(f"residual of {self.joints[j]} [{force}]", _most(leading.residual[j][weight > 0]), *means.values())
        chart = Chart(self.stream, f"{self.at}/{kind}/{self.joints[j]}", x, y, NARROW)
        self._dots(chart, seen, leading.residual[j], weight, GREY)
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
        """Send what is left of the torque without the rigid body, over velocity, the laws that were found, and the true one."""
        mine = np.array([p.kind in FRICTIONS and p.joint == j for p in self.fit.basis.parameters])
        if not mine.any():
            return
        force, way = self._units(j)
        form, leading = next(iter(left.items()))
        qd, laws = self._state("over_velocity", j, leading), dict[str, Array]()
        for name, one in left.items():
            laws[name] = self._law(one, np.where(mine, self.fit.estimates[name].X, 0.0), j)
        if self.fit.truth is not None:
            laws["true"] = self._law(leading, np.where(mine, list(self.fit.truth.values()), 0.0), j)
        torque, weight = leading.residual[j] + laws[form], leading.weight[j]
        y = linear(f"friction of {self.joints[j]} [{force}]", _around(np.concatenate(list(laws.values()))))
        chart = Chart(self.stream, f"{self.at}/friction/{self.joints[j]}", linear(f"qd [{way}/s]", qd), y, NARROW)
        self._dots(chart, qd, torque, weight, GREY)
        order = np.argsort(qd)[:: max(1, len(qd) // LAW)]
        for name, law in laws.items():
            chart.line(name, qd[order], law[order], self._color(name), 2.5 if name == "explicit" else 1.2)

    def _law(self, left: Instants, X: Array, j: int) -> Array:
        return left.equations.predicted(X)[j, left.inner]

    def _spectrum(self, row: str, joint: int, left: Mapping[str, Instants]) -> None:
        """Send spectra of what models leave over in a row, what the noise found predicts, and the cut-offs of the chain."""
        fs, lines, f = self.fit.logs.fitted[0].fs, dict[str, Array](), np.empty(0)
        for form, one in left.items():
            weight = one.weight[joint]
            f, density = spectrum(one.residual[joint] * weight, fs, RESOLUTION)
            lines[form] = density / np.sqrt(max(np.mean(weight**2), 1e-12))  # as if what is masked were like the rest
        highest = max(density[1:].max() for density in lines.values())
        if "explicit" in left:
            estimate = self.fit.estimates["explicit"]
            expected = noise_spectra(estimate.problem, estimate.noise_levels, f)
            lines |= {f"{kind} noise": each[joint] for kind, each in zip(("torque", "position"), expected, strict=True)}
        unit = "W" if row == "power" else self._units(joint)[0]
        shown = [np.maximum(density[1:], FAINTEST * highest) for density in lines.values()]
        y = decades(f"residual of {row} [{unit}/√Hz]", *shown)
        chart = Chart(self.stream, f"{self.at}/spectrum/{row}", decades("f [Hz]", f[1:]), y)
        for name, density in lines.items():
            chart.line(name, f[1:], density[1:], self._color(name), 2.5 if name == "explicit" else 1.2)
        for name, cutoff in cutoffs(self.fit.processing, fs).items():
            chart.line(f"cut-off {name}", np.full(2, cutoff), np.array([y.low, y.high]), DARK)


def _around(x: Array) -> Array:
    """Return the ends of an axis on which a law fills the middle third: dots beyond it are noise that would hide it."""
    low, high = float(x.min()), float(x.max())
    return np.array([low, high]) + (high - low) * np.array([-1.0, 1.0])


def _most(x: Array) -> Array:
    """Return between which values nine of ten lie, with some room, so that wild ones do not set the scale."""
    low, high = np.quantile(x, [0.05, 0.95]) if len(x) else np.zeros(2)
    return np.array([low, high]) + 0.5 * (high - low) * np.array([-1.0, 1.0])


COLORS: dict[str, Color] = {"true": GREY, "torque noise": JOINTS[1], "position noise": JOINTS[0]}
