"""The layer of an identification: what its models make of a recorded motion, and what they leave over."""

from collections.abc import Mapping, Sequence

import numpy as np
import rerun as rr

from experiments.identification.identified import Identified
from experiments.recording.audience import Audience
from experiments.recording.columns import Times, part, seconds, time_columns
from experiments.recording.lanes import Lanes, mask_states
from experiments.recording.layouts import tabs
from experiments.recording.smoothed_layer import send_smoothed
from experiments.recording.stream import Stream
from experiments.recording.style import FORM_WIDTHS, FORMS, GREY, JOINTS, Color, kind_colors, lighter
from experiments.recording.texts import estimates_table, judged, noise_table, short_table
from identify import (
    MODELS,
    Array,
    Estimate,
    Instants,
    binned,
    cutoffs,
    filtered,
    instants,
    measured_state,
    noise_spectra,
    recursive_least_squares,
    spectrum,
)

EVERY = 0.5
"""Time between the instants of recursive estimates [s]."""

BINS = {"over_velocity": 41, "over_position": 240}
"""Bins of residuals: over position fine enough for a motor of many slots."""

RESOLUTION = 0.5
"""Distance of the frequencies of a spectrum [Hz]."""

WIDEST = 0.5
"""A recursive estimate is shown once its sigma has been below this share of the last one, and in the second half anyway."""

FLOOR = 1e-5
"""Amplitude density [N m/sqrt(Hz)], or [W/sqrt(Hz)], that a spectrum shows as 0 dB."""


class Layer:
    """What the identification of one log adds to its recording.

    Parameters
    ----------
    name : str
        Recording id of the motion.
    found : Identified
        The identification of one log.
    joints : sequence of str
        Names of the joints.
    known : set of str
        Entities that the recording has already.
    audience : Audience, optional
        Who watches.
    """

    def __init__(
        self, name: str, found: Identified, joints: Sequence[str], known: set[str], audience: Audience | None = None
    ) -> None:
        self.stream, self._found, self._known = Stream(name, audience, layer=True), found, known
        self._joints = [part(joint) for joint in joints]
        self._log, self._chain, self._at = found.logs[0], found.processing, f"identify/{found.label}"
        methods = {path.strip("/").split("/")[1] for path in known if path.strip("/").startswith("identify/")}
        self._shade = len(methods - {found.label})
        self._signals = found.problem.signals[0]
        self._highest = 0.0

    def send(self) -> None:
        """Send everything."""
        self._motion()
        for form, estimate in self._found.estimates.items():
            at, color = f"{self._at}/{form}", self._color(form)
            self._rows(at, form, estimate, color)
            self._columns(at, form, estimate)
            self._running(at, form, estimate, color)
            self._left_over(at, form, estimate, color)
            self._judge(form, estimate)
            for fit in estimate.fits.values():
                send_smoothed(self.stream, self._at, fit, self._joints)
        self._truth()
        for name, cutoff in cutoffs(self._chain, self._log.fs).items():
            mark = rr.BarChart([1.1 * self._highest], abscissa=[cutoff], widths=[RESOLUTION / 3], color=GREY)
            self.stream.keep(f"{self._at}/cutoff/{name}", mark)
        for name, text in (
            ("report", estimates_table(self._found)),
            ("estimates", short_table(self._found)),
            ("noise", noise_table(self._found, self._joints)),
        ):
            self.stream.keep(f"{self._at}/{name}", rr.TextDocument(text, media_type=rr.MediaType.MARKDOWN))
        self.stream.arrange(tabs(self._known | self.stream.paths))
        self.stream.breathe(0.0)

    def _color(self, form: str) -> list[int]:
        return lighter(FORMS.get(form, GREY), self._shade)

    def _names(self, form: str, system_rows: int) -> Sequence[str]:
        """Return what the kinds of row of a model are called: after their joint, or after the model."""
        return self._joints if system_rows == len(self._joints) and form != "power" else [form] * system_rows

    def _curve(self, path: str, times: Times, values: Array, name: str, color: Color, width: float) -> None:
        self.stream.style(path, [name], [color], width)
        self.stream.curves(path, times, values)

    def _motion(self) -> None:
        """Send the motion as it was measured, and as the rows see it, and which instants are masked."""
        log, grid = self._log, self._chain.grid(self._log)
        raw, seen = measured_state(log, self._chain), filtered(self._signals, self._chain)
        inner = slice(grid.first, -grid.first or None)
        for name, values in seen.items():
            kinds = {"filtered": (np.arange(log.samples)[grid.samples], values)}
            if name != "q":  # that is in the base
                kinds["measured"] = np.arange(log.samples)[inner], getattr(raw, name)[:, inner]
            for kind, (samples, curves) in kinds.items():
                path, colors = f"{self._at}/{name}/{kind}", kind_colors(kind, len(self._joints))
                self.stream.style(path, [f"{kind} {joint}" for joint in self._joints], colors)
                self.stream.curves(path, time_columns(samples / log.fs, log.fs), curves.T)
        lanes, weight = Lanes(self.stream, log.fs), self._signals.weight
        for joint, of_joint in zip(self._joints, weight, strict=True):
            lanes.send(f"{self._at}/mask/{joint}", log.t, mask_states(of_joint))

    def _rows(self, at: str, form: str, estimate: Estimate, color: Color) -> None:
        """Send what was measured, what is predicted, and the residual, an entity for each kind of row."""
        found, label = estimate.rows, self._found.label if self._shade else ""
        for kind, row in enumerate(self._names(form, found.kinds)):
            rows = (found.group == kind) & found.valid
            times, named = [seconds(found.time[rows])], f"{form} {label}".strip()
            self._curve(f"{at}/measured/{row}", times, found.Y[rows], "measured", GREY, 6.0)
            width = FORM_WIDTHS.get(form, 1.5) / (1 + self._shade)  # so that what lies below shows
            self._curve(f"{at}/predicted/{row}", times, estimate.predicted[rows], named, color, width)
            self._curve(f"{at}/residual/{row}", times, estimate.residual[rows], named, color, width)

    def _columns(self, at: str, form: str, estimate: Estimate) -> None:
        """Send the columns of W, scaled to unit length, and its singular values."""
        found = estimate.rows
        length = np.linalg.norm(found.W, axis=0)
        W = found.W / np.where(length > 0, length, 1.0)
        if form != "implicit":  # whose W is the explicit one's, but for the differences
            for kind, row in enumerate(self._names(form, found.kinds)):
                rows = (found.group == kind) & found.valid
                used = np.flatnonzero(np.abs(W[rows]).max(axis=0) > 0)
                path, colors = f"{at}/columns/{row}", [JOINTS[p % len(JOINTS)] for p in used]
                self.stream.style(path, [estimate.names[p] for p in used], colors)
                self.stream.curves(path, [seconds(found.time[rows])], W[rows][:, used])
        values = np.linalg.svd(found.factors.together.R_W, compute_uv=False)
        self._bars(f"{at}/singular_values", np.log10(values / values[-1]), form)

    def _running(self, at: str, form: str, estimate: Estimate, color: Color) -> None:
        """Send the estimate as it comes about, with its variance, once that is small enough to be worth a look."""
        if estimate.whiten is None:
            return
        log = self._log
        t = np.append(np.arange(EVERY, log.t[-1], EVERY), log.t[-1] + self._chain.halo(log.fs, log.torque))
        running = recursive_least_squares(estimate, t, self._chain.halo(log.fs, log.torque))
        t = np.minimum(t, log.t[-1])
        for p, name in enumerate(estimate.names):
            settled = np.logical_or.accumulate(running.sigma[:, p] < WIDEST * np.abs(running.X[-1, p]))
            known = np.isfinite(running.X[:, p]) & (settled | (t > t[-1] / 2))
            path, variance = f"{at}/estimate/{name}", running.sigma[known, p] ** 2
            self.stream.keep(path, rr.Measurements.from_fields(names=[form], colors=[color], widths=[2.0]))
            columns = rr.Measurements.columns(values=running.X[known, p], variances=variance)
            self.stream.send(path, [seconds(t[known])], columns)

    def _left_over(self, at: str, form: str, estimate: Estimate, color: Color) -> None:
        """Send the residual before the operator: over velocity and position, and its spectrum."""
        log = self._log
        left = instants(self._signals, self._found.basis, MODELS.create(form), self._chain, estimate.X)
        names = self._names(form, len(left.residual))
        if names is self._joints:
            self._over(at, form, left)
        for joint, (row, residual, weight) in enumerate(zip(names, left.residual, left.weight, strict=True)):
            f, density = spectrum(residual * weight, log.fs, RESOLUTION)
            density = density / np.sqrt(max(np.mean(weight**2), 1e-12))  # as if what is masked were like the rest
            height = _decibels(density)
            path = f"{self._at}/{form}/spectrum/{row}"
            self.stream.keep(path, rr.BarChart(height, abscissa=f, widths=np.full(len(f), f[1]), color=color))
            self._highest = max(self._highest, height.max())
            if form == "explicit":
                self._noise(estimate, row, joint, f)

    def _noise(self, estimate: Estimate, row: str, joint: int, f: Array) -> None:
        """Send the spectra that the noise found in the log should have in the explicit model's residual, beside each other."""
        each = zip(("torque", "position"), noise_spectra(estimate.problem, estimate.noise_levels, f), (-0.2, 0.2), strict=True)
        for (kind, density, aside), color in zip(each, (JOINTS[1], JOINTS[0]), strict=True):
            width, at = np.full(len(f), 0.3 * f[1]), f + aside * f[1]
            chart = rr.BarChart(_decibels(density[joint]), abscissa=at, widths=width, color=color)
            self.stream.keep(f"{self._at}/explicit/noise_{kind}/{row}", chart)

    def _over(self, at: str, form: str, left: Instants) -> None:
        state, last = measured_state(self._log, self._chain), left.first + left.residual.shape[-1]
        for kind, x in (("over_velocity", state.qd), ("over_position", state.q)):
            for joint, of_joint, residual, weight in zip(self._joints, x, left.residual, left.weight, strict=True):
                seen = of_joint[left.first : last]
                edges: Array = np.linspace(seen.min(), seen.max(), BINS[kind] + 1)
                mean = binned(seen, residual, weight, edges)
                middle, width = (edges[1:] + edges[:-1]) / 2, float(edges[1] - edges[0])
                self.stream.bars(f"{at}/{kind}/{joint}", mean, middle, width, self._color(form))

    def _judge(self, form: str, estimate: Estimate) -> None:
        """Send the error of every parameter, where the truth is known, or its sigma."""
        kind = "relative_sigma" if self._found.truth is None else "error"
        values = judged(self._found, estimate)
        self._bars(f"{self._at}/{form}/{kind}", values, form)

    def _bars(self, path: str, values: Array, form: str) -> None:
        forms = list(self._found.estimates)
        self.stream.grouped_bars(path, values, forms.index(form), len(forms), self._color(form))

    def _truth(self) -> None:
        """Send the true parameters as lines from the beginning to the end."""
        ends: Mapping[str, float] = self._found.truth or {}
        for name, value in ends.items():
            times = time_columns(self._log.t[[0, -1]], self._log.fs)
            self._curve(f"truth/{name}", times, np.array([value, value]), "true", GREY, 3.0)


def _decibels(density: Array) -> Array:
    """Return amplitude densities in dB over FLOOR, 0 below it."""
    return np.maximum(20 * np.log10(np.maximum(density, 1e-300) / FLOOR), 0.0)
