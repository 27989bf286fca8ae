"""The layer of an identification: what its models make of a recorded motion, and their residuals; or of one that grows."""

import sys
from collections.abc import Sequence

import numpy as np
import rerun as rr

from idbench.experiments.errors import reason, report
from idbench.experiments.identification.fit import Fit
from idbench.experiments.identification.fitting import fit
from idbench.experiments.identification.logs import Logs
from idbench.experiments.identification.method import Method
from idbench.experiments.identification.request import Request
from idbench.experiments.identification.robot_model import RobotModel
from idbench.experiments.recording.audience import Audience
from idbench.experiments.recording.chart import send_keys
from idbench.experiments.recording.folder import layer_file
from idbench.experiments.recording.lanes import Lanes, estimates_table, noise_table, short_table
from idbench.experiments.recording.layouts import tabs
from idbench.experiments.recording.residual_charts import ResidualCharts, send_iterations, send_parameters
from idbench.experiments.recording.stream import Stream, part, parts, seconds, shown, time_columns
from idbench.experiments.text import FORM_WIDTHS, FORMS, GREY, JOINTS, UNITS, Color, joint_colors, kind_colors, model_color
from idbench.identify import (
    Array,
    Estimate,
    IdentificationError,
    JointFit,
    MotionLog,
    TorqueChannel,
    filtered,
    measured_state,
    recursive_least_squares,
    smoothed_motion,
)
from idbench.identify.rows.rows import is_long

EVERY = 0.5  # Time between the instants of recursive estimates [s]
WIDE = 7.0  # Width of what a mistake explains, on which the residual is drawn

WIDEST = 0.5
"""A recursive estimate is shown once its sigma has been below this share of the last one, and in the second half anyway."""


class Layer:
    """What the identification of one log adds to the recording `name`, which has the entities `known` already."""

    def __init__(self, name: str, fit: Fit, joints: Sequence[str], known: set[str], audience: Audience | None = None) -> None:
        self.stream = Stream(name, audience, layer=True)
        self._fit = fit
        self._known = known
        self._joints = parts(joints)
        self._log = fit.logs.fitted[0]
        self._chain = fit.processing
        self._at = f"identify/{fit.request.label}"
        methods = {path.strip("/").split("/")[1] for path in known if path.strip("/").startswith("identify/")}
        self._shade = len(methods - {fit.request.label})
        self._signals = fit.problem.signals[0]
        self._called = fit.request.label if self._shade else ""

    def send(self, head: str = "") -> tuple[str, Stream]:
        """Send everything, `head` above the estimates; return the stream, and the name of its file."""
        self._motion()
        for form, estimate in self._fit.estimates.items():
            at, color = f"{self._at}/{form}", model_color(form, self._shade)
            width = FORM_WIDTHS.get(form, 1.5) / (1 + self._shade)  # so that what lies below shows
            names = row_names(form, estimate.rows.kinds, self._joints)
            send_rows(self.stream, at, f"{form} {self._called}".strip(), estimate, names, color, width)
            self._columns(at, form, estimate, names)
            self._running(at, form, estimate, color)
            for joint_fit in estimate.fits.values():
                self._smoothed(joint_fit)
        self._mistake()
        self._truth()
        ResidualCharts(self.stream, self._at, self._fit, self._joints, self._shade).send()
        send_parameters(self.stream, self._at, self._fit, self._shade)
        send_iterations(self.stream, self._at, self._fit)
        keys = {f"{self._fit.request.label}:": GREY, **{form: model_color(form, self._shade) for form in self._fit.estimates}}
        send_keys(self.stream, f"legend/{self._fit.request.label}", keys)
        first = dict([*keys.items()][:2])  # the leading model
        send_keys(self.stream, f"leading/{self._fit.request.label}", first)
        self.stream.page(f"{self._at}/report", estimates_table(self._fit))
        self.stream.page(f"{self._at}/estimates", "\n\n".join(filter(None, (head, short_table(self._fit)))))
        self.stream.page(f"{self._at}/noise", noise_table(self._fit, self._joints))
        self.stream.keep_sizes()
        self.stream.arrange(tabs(self._known | self.stream.paths))
        self.stream.breathe(0.0)
        return layer_file(self._fit.request.label), self.stream

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
                kept = shown(0, len(samples), log.fs / float(np.diff(samples[:2], append=samples[-1:] + 1)[0]))
                self.stream.curves(path, time_columns(samples[kept] / log.fs, log.fs), curves.T[kept])
        lanes, weight = Lanes(self.stream, log.fs), self._signals.weight
        for joint, of_joint in zip(self._joints, weight, strict=True):
            used = np.where(of_joint == 0, "masked", np.where(of_joint < 1, "partly", "used"))
            lanes.send(f"{self._at}/mask/{joint}", log.t, used)

    def _smoothed(self, fit: JointFit) -> None:
        """Send the smoothed motion with its band of one sigma, and how far measured positions and their differences are off."""
        log, motion = fit.logs[0].log, smoothed_motion(fit)
        q = log.q[np.rint(motion.t * log.fs).astype(np.intp)]
        measured = {"q": q, "qd": np.gradient(q, 1 / log.fs, axis=0)}
        for name, sigma in (("q", motion.sigma_q), ("qd", motion.sigma_qd), ("qdd", motion.sigma_qdd)):
            for k, (joint, color) in enumerate(zip(self._joints, joint_colors(len(self._joints)), strict=True)):
                value = getattr(motion, name)[:, k]
                self._band(f"smoothed/{name}/{joint}", motion.t, value, sigma[:, k], color)
                if name in measured:
                    left = measured[name][:, k] - value
                    path = f"{self._at}/measured_less_smoothed/{name}/{joint}"
                    self.stream.curve(path, [seconds(motion.t)], left, "measured - smoothed", GREY, 1.0)
                    self._band(f"smoothed_band/{name}/{joint}", motion.t, 0 * left, sigma[:, k], color)

    def _band(self, path: str, t: Array, values: Array, sigma: Array, color: Color) -> None:
        path = f"{self._at}/{path}"
        self.stream.keep(path, rr.Measurements.from_fields(names=["smoothed"], colors=[color], widths=[1.5]))
        self.stream.send(path, [seconds(t)], rr.Measurements.columns(values=values, variances=sigma**2))

    def _columns(self, at: str, form: str, estimate: Estimate, names: Sequence[str]) -> None:
        """Send the columns of W, scaled to unit length."""
        found = estimate.rows
        length = np.linalg.norm(found.W, axis=0)
        W = found.W / np.where(length > 0, length, 1.0)
        if form != "implicit":  # whose W is the explicit one's, but for the differences
            for kind, row in enumerate(names):
                rows = (found.group == kind) & found.valid
                used = np.flatnonzero(np.abs(W[rows]).max(axis=0, initial=0.0) > 0)
                if not len(used):  # a joint that never moves
                    continue
                path, colors = f"{at}/columns/{row}", [JOINTS[p % len(JOINTS)] for p in used]
                of = [estimate.names[p] for p in used]
                self.stream.style(path, of, colors)
                self.stream.curves(path, [seconds(found.time[rows])], W[rows][:, used])
                send_keys(self.stream, f"{path}/keys", dict(zip(of, colors, strict=True)))

    def _running(self, at: str, form: str, estimate: Estimate, color: Color) -> None:
        """Send the estimate as it comes about, with its variance, once that is small enough to be worth a look."""
        if estimate.independent_rows() is None:
            return
        log = self._log
        t = np.append(np.arange(EVERY, log.t[-1], EVERY), log.t[-1] + self._chain.halo(log.fs, log.torque))
        running = recursive_least_squares(estimate, t, self._chain.halo(log.fs, log.torque))
        t = np.minimum(t, log.t[-1])
        for p, name in enumerate(estimate.names):
            settled = np.logical_or.accumulate(running.sigma[:, p] < WIDEST * np.abs(running.X[-1, p]))
            known = np.isfinite(running.X[:, p]) & (settled | (t > t[-1] / 2))
            path, variance = f"{at}/estimate/{part(name)}", running.sigma[known, p] ** 2
            self.stream.keep(path, rr.Measurements.from_fields(names=[form], colors=[color], widths=[2.0]))
            self.stream.send(path, [seconds(t[known])], rr.Measurements.columns(values=running.X[known, p], variances=variance))

    def _mistake(self) -> None:
        """Send what the first mistake that residuals show explains of them."""
        first = next(iter(self._fit.diagnosis or ()), None)
        if first is None or first.suspect.explained is None:
            return
        rows, form = self._fit.problem.explicit.rows, self._fit.leading
        for kind, joint in enumerate(self._joints):
            own = (rows.group == kind) & rows.valid
            path, color = f"{self._at}/{form}/explained/{joint}", joint_colors(len(self._joints))[kind]
            self.stream.curve(path, [seconds(rows.time[own])], first.suspect.explained[own], first.short, color, WIDE)

    def _truth(self) -> None:
        """Send the true parameters as lines from the beginning to the end."""
        times = time_columns(self._log.t[[0, -1]], self._log.fs)
        for name, value in (self._fit.truth or {}).items():
            self.stream.curve(f"truth/{part(name)}", times, np.array([value, value]), "true", GREY, 3.0)


def row_names(form: str, kinds: int, joints: Sequence[str]) -> Sequence[str]:
    """Names of the kinds of row of a model: after their joint, or after the model if theirs is another unit."""
    if form not in UNITS:
        return [*joints, "power"][:kinds] if kinds in (len(joints), len(joints) + 1) else [form] * kinds
    return [form] if kinds == 1 else [f"{form} {joint}" for joint in joints]


def send_rows(  # noqa: PLR0913  # what to send, and how it looks
    stream: Stream, at: str, named: str, estimate: Estimate, names: Sequence[str], color: Color, width: float, *,
    after: float = -np.inf,
) -> None:  # fmt: skip
    """Send what was measured, what is predicted, and the residual, an entity for each kind of row; of rows `after` a time."""
    found = estimate.rows
    for kind, row in enumerate(names):
        rows = (found.group == kind) & found.valid & (found.time > after)
        times = [seconds(found.time[rows])]
        stream.curve(f"{at}/measured/{row}", times, found.Y[rows], "measured", GREY, 6.0)
        stream.curve(f"{at}/predicted/{row}", times, estimate.predicted[rows], named, color, width)
        stream.curve(f"{at}/residual/{row}", times, estimate.residual[rows], named, color, width)


GROWTH = 1.1
"""How much longer the log must be before it is identified again: so often that the work stays in proportion to the log."""

ESTIMATOR = "WLS"  # Quick, as it is asked again and again

LABEL = "so-far"


class LiveIdentification:
    """What can be said of a log that grows, sampled at `fs` [Hz], shown in a stream; `joints` are parts of paths."""

    def __init__(
        self, stream: Stream, robot_model: RobotModel, chain: str, channel: TorqueChannel, fs: float, joints: Sequence[str]
    ) -> None:
        self._stream = stream
        self._channel = channel
        self._fs = fs
        self._request = Request(robot_model, method=Method.named(chain, ESTIMATOR), name=LABEL)
        self._joints = joints
        self._q = list[Array]()
        self._tau = list[Array]()
        self._identified = 0
        self._shown = dict[str, float]()
        self._broken = False
        self.fit: Fit | None = None

    def grow(self, q: Array, tau: Array) -> bool:
        """Take in positions [rad] and torques [N m], shape (time, joint); return whether the estimates were made anew."""
        self._q.append(q)
        self._tau.append(tau)
        samples = sum(map(len, self._q))
        if self._broken or samples < GROWTH * self._identified:
            return False
        self._identified = samples
        try:
            log = MotionLog(self._fs, np.concatenate(self._q), np.concatenate(self._tau), self._channel)
            self.fit = fit(self._request, Logs((log,)))
            with self._stream.draft():
                for form, estimate in self.fit.estimates.items():
                    self._show(form, estimate, float(log.t[-1]))
        except IdentificationError:  # too short yet, or not yet excited
            return False
        except Exception as error:  # the run is not lost because what is shown of it is
            self._broken = True
            sys.stderr.write(
                f"idbench: nothing more is identified while the robot moves ({reason(error)}; its traceback is in "
                f"{report(error)}); the work goes on\n"
            )
            return False
        return True

    def _show(self, form: str, estimate: Estimate, now: float) -> None:
        at, color = f"identify/{LABEL}/{form}", FORMS.get(form, GREY)
        for name, x, sigma in zip(estimate.names, estimate.X, estimate.standard_errors, strict=True):
            if form not in self._shown:
                self._stream.keep(f"{at}/estimate/{part(name)}", rr.Measurements.from_fields(names=[form], colors=[color]))
            columns = rr.Measurements.columns(values=[x], variances=[sigma**2])
            self._stream.send(f"{at}/estimate/{part(name)}", [seconds(np.array([now]))], columns)
        if is_long(estimate.problem.logs):  # of which no rows are kept
            return
        names = row_names(form, estimate.rows.kinds, self._joints)
        last = self._shown.get(form, -np.inf)
        send_rows(self._stream, at, form, estimate, names, color, FORM_WIDTHS.get(form, 1.5), after=last)
        self._shown[form] = float(estimate.rows.time[estimate.rows.valid].max(initial=last))
