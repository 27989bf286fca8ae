"""The base of a recording: a motion, what was planned, measured and true, and what the drives did."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Literal

import numpy as np
import rerun as rr

from idbench.experiments.recording.audience import Audience
from idbench.experiments.recording.chart import send_keys
from idbench.experiments.recording.lanes import ROLES, Lanes, joint_states
from idbench.experiments.recording.layouts import tabs
from idbench.experiments.recording.stream import POSES, Stream, Times, part, parts, poses, seconds, shown, time_columns
from idbench.experiments.text import GREY, WIDTHS, Color, joint_colors, kind_colors
from idbench.identify import Array, MotionLog
from idbench.identify.signals.masks import slow_speed
from idbench.sim.drives.drive import BetweenEdges
from idbench.sim.engine.watch import Inner, WatchedStretch
from idbench.sim.robot.robot import Robot
from idbench.sim.robot.scene import Mover, SceneShape, shapes

if TYPE_CHECKING:
    from idbench.experiments.recording.identification_layer import LiveIdentification


class Arm:
    """The arms of a recording, of these `ROLES`; the first is drawn solid."""

    def __init__(self, stream: Stream, robot: Robot, roles: tuple[str, ...]) -> None:
        self._stream = stream
        self._robot = robot
        self._mover = Mover(robot)
        two = self._mover.at(np.stack([np.zeros(robot.n), np.full(robot.n, 0.1)]))
        pose = {body: np.concatenate([x, two.quaternions[body]], axis=1) for body, x in two.positions.items()}
        self._moving = {body for body, (at, moved) in pose.items() if not np.array_equal(at, moved)}
        stream.keep("world", rr.ViewCoordinates.RIGHT_HAND_Z_UP)
        for body in pose.keys() - self._moving:
            where = rr.Transform3D(translation=two.positions[body][0], quaternion=rr.Quaternion(xyzw=two.quaternions[body][0]))
            stream.keep(f"world/{roles[0]}/{part(body)}", where)
        for role in roles:
            for shape in shapes(robot):
                if role == roles[0] or shape.body in self._moving:
                    path = f"world/{role}/{part(shape.body)}/{part(shape.name)}"
                    where = rr.Transform3D(translation=shape.position, quaternion=rr.Quaternion(xyzw=shape.quaternion))
                    stream.keep(path, _drawn(shape, None if role == roles[0] else ROLES[role][0]), where)

    def move(self, times: Times, where: Mapping[str, Array]) -> None:
        """Send where arms are, by their role, at positions [rad] of shape (time, joint)."""
        moving = self._mover.at(np.concatenate(list(where.values())))
        for k, (role, q) in enumerate(where.items()):
            mine = slice(k * len(q), (k + 1) * len(q))
            for body in self._moving:
                at, turned = moving.positions[body][mine], moving.quaternions[body][mine]
                self._stream.send(f"world/{role}/{part(body)}", times, poses(at, turned))

    def trace(self, q: Array) -> None:
        """Draw the way of every site along `q` [rad], shape (time, joint)."""
        for site, position in Mover(self._robot).at(q).sites.items():
            line = rr.LineStrips3D([position], radii=[0.0015], colors=[[190, 190, 190]])
            self._stream.keep(f"world/path_of_{part(site)}", line)


def _drawn(shape: SceneShape, wire: Color | None) -> rr.AsComponents:
    """Return a shape: solid in its own colour, or as wires of the colour `wire`."""
    color, size = [shape.rgba if wire is None else wire], shape.size
    fill: Literal["solid", "majorwireframe"] = "solid" if wire is None else "majorwireframe"
    match shape.kind:
        case "box":
            return rr.Boxes3D(half_sizes=[size], colors=color, fill_mode=fill)
        case "cylinder":
            return rr.Cylinders3D(lengths=[2 * size[1]], radii=[size[0]], colors=color, fill_mode=fill)
        case "capsule":  # rerun's starts at the origin, MuJoCo's is centred there
            centre = [[0.0, 0.0, -size[1]]]
            return rr.Capsules3D(lengths=[2 * size[1]], radii=[size[0]], translations=centre, colors=color, fill_mode=fill)
        case "sphere" | "ellipsoid":
            half = [size[0]] * 3 if shape.kind == "sphere" else size
            return rr.Ellipsoids3D(half_sizes=[half], colors=color, fill_mode=fill)
        case "mesh" if wire is None:
            return rr.Mesh3D(vertex_positions=shape.vertices, triangle_indices=shape.faces, albedo_factor=shape.rgba)
        case "mesh":
            low, high = shape.vertices.min(axis=0), shape.vertices.max(axis=0)  # every edge of a mesh would hide the arm
            return rr.Boxes3D(half_sizes=[(high - low) / 2], centers=[(high + low) / 2], colors=color, fill_mode=fill)


LOGGED = {"q/measured", "torque/log"}  # What a robot would log: numbered by samples, too, which takes room
ELECTRIC = ("reference", "current", "voltage", "duty", "emf")  # Signals of a drive


class Base:
    """A recording that grows with the motion that it shows, sampled at `fs` [Hz].

    `roles` are the arms that are drawn, of `ROLES`; `qd` are the velocities of the whole motion, planned or measured [rad/s],
    shape (time, joint): they say which are slow.
    """

    def __init__(
        self, name: str, robot: Robot, fs: float, roles: tuple[str, ...], qd: Array, audience: Audience | None = None
    ) -> None:
        self.stream, self._audience = Stream(name, audience), audience
        self.inner: Stream | None = None
        self.live: LiveIdentification | None = None
        self._shown, self._window = 0, (np.inf, -np.inf)
        self._joints = parts(robot.joints)
        self._fs = fs
        self._roles = roles
        self._slow = slow_speed(qd.T)
        for number, joint in enumerate(self._joints):  # for layouts, which see entities alone, in the order of their names
            self.stream.keep(f"joints/{number:03}/{joint}", rr.TextDocument(joint))
        self.arm, self._lanes = Arm(self.stream, robot, roles), Lanes(self.stream, fs)
        self._before, self._turning = (np.empty(0), np.empty((0, robot.n))), np.zeros(robot.n)
        keys = {"measured": GREY, **dict(zip(self._joints, joint_colors(robot.n), strict=True))}
        send_keys(self.stream, "legend/joints", keys)
        if audience:
            audience.begin()

    def stretch(self, stretch: WatchedStretch) -> None:
        """Send a stretch of a simulation, as it is heard from it."""
        signals, t = _signals(stretch), (stretch.first + np.arange(len(stretch.q))) / self._fs
        if stretch.electric is not None:
            signals |= {f"drive/{name}": getattr(stretch.electric, name) for name in ELECTRIC}
        if stretch.inner is not None:
            self.inside(stretch.inner)
        self._accelerate(t, stretch.qd)
        if self.live:
            self.live.grow(stretch.measured, stretch.logged)
        poses = {"true": stretch.q, "planned": stretch.reference.q, "measured": stretch.measured}
        limited = stretch.electric.limited if stretch.electric else None
        self.add(stretch.first, signals, {role: poses[role] for role in self._roles}, stretch.qd, limited)

    def add(
        self, first: int, signals: Mapping[str, Array], poses: Mapping[str, Array], qd: Array, limited: Array | None = None
    ) -> None:
        """Send what happened from sample `first` on, arrays of shape (time, joint).

        `signals` are curves by their path, `poses` positions [rad] of the arms by their role, `qd` velocities [rad/s] by which
        joints count as at rest, `limited` the share of each sample for which a drive was at a limit of its.
        """
        t = (first + np.arange(len(qd))) / self._fs
        kept, seen = self._kept(first, t), shown(first, len(qd), self._fs, POSES)
        times = time_columns(t[kept], self._fs)
        for path, values in signals.items():
            self._curves(self.stream, path, times if path in LOGGED else times[:1], values[kept])
        if seen.any():
            self.arm.move([seconds(t[seen])], {role: q[seen] for role, q in poses.items()})
        for j, joint in enumerate(self._joints):
            states = joint_states(qd[:, j], self._slow[j], None if limited is None else limited[:, j], self._turning[j])
            self._lanes.send(f"state/{joint}", t, states)
        self._turning = qd[-1]
        there = self.stream.shown | (self.inner.paths if self.inner else set())
        if self._audience and self._shown != len(there):
            self._shown = len(there)
            self.stream.show(tabs(there))
        self.stream.breathe(float(t[-1]))

    def replay(self, log: MotionLog, signals: Mapping[str, Array], qd: Array) -> None:
        """Send a log and what else is known of it, as fast as the audience wants to see it."""
        every = self._audience.every if self._audience else log.samples / log.fs
        step, all_signals = max(1, round(every * log.fs)), {"q/measured": log.q, "torque/log": log.tau, **signals}
        for first in range(0, log.samples, step):
            now = slice(first, first + step)
            self.add(first, {p: x[now] for p, x in all_signals.items()}, dict.fromkeys(self._roles, log.q[now]), qd[now])

    def also(self, path: str, values: Array) -> None:
        """Send curves of the whole motion, shape (time, joint), that are known at its end."""
        t = np.arange(len(values)) / self._fs
        kept = self._kept(0, t)
        self._curves(self.stream, path, time_columns(t[kept], self._fs)[:1], values[kept])

    def finish(self, text: str) -> None:
        """Send a text about it all, and the layout."""
        self.stream.page("about", text)
        self.stream.keep_sizes()
        self.stream.arrange(tabs(self.stream.paths | (self.inner.paths if self.inner else set())))

    def _curves(self, stream: Stream, path: str, times: Times, values: Array) -> None:
        if path not in stream.paths:
            kind, colors = path.rsplit("/", 1)[-1], len(self._joints)
            stream.style(path, [f"{kind} {joint}" for joint in self._joints], kind_colors(kind, colors), WIDTHS.get(kind, 1.5))
        stream.curves(path, times, values)

    def _accelerate(self, t: Array, qd: Array) -> None:
        """Send the mean acceleration from sample to sample, in the middle between them."""
        t, qd = np.concatenate([self._before[0], t]), np.concatenate([self._before[1], qd])
        self._before = t[-1:], qd[-1:]
        if len(t) > 1:
            kept = self._kept(round(t[0] * self._fs), t[:-1])
            middle = [seconds(((t[1:] + t[:-1]) / 2)[kept])]
            self._curves(self.stream, "qdd/true", middle, (np.diff(qd, axis=0) * self._fs)[kept])

    def _kept(self, first: int, t: Array) -> np.typing.NDArray[np.bool_]:
        """Mask of the recorded samples: as many as can be seen, and all where the inside of the loop is recorded, too."""
        return shown(first, len(t), self._fs) | ((t >= self._window[0]) & (t <= self._window[1]))

    def inside(self, inner: Inner) -> None:
        """Send signals inside the loop, in a layer of their own."""
        self._window = min(self._window[0], inner.t[0]), max(self._window[1], inner.t[-1])
        if self.inner is None:
            self.inner = Stream(self.stream.name, self._audience, layer=True)
        times = [seconds(inner.t)]
        for name in ELECTRIC:
            self._curves(self.inner, f"inner/{name}", times, getattr(inner.electric, name))
        self._curves(self.inner, "inner/torque", times, inner.tau)
        if inner.edges is not None:
            self._between_edges(self.inner, inner.t, inner.edges)

    def _between_edges(self, stream: Stream, t: Array, edges: BetweenEdges) -> None:
        """Send currents and voltages within the periods; edges of joints are not at the same times."""
        for j, (joint, color) in enumerate(zip(self._joints, joint_colors(len(self._joints)), strict=True)):
            at = (t + edges.t[:, :, j]).T.reshape(-1, 3)
            lasts = at[:, 2] > at[:, 0]
            times, current = at[lasts].ravel(), edges.current[:, :, j].T.reshape(-1, 3)[lasts].ravel()
            stream.curve(f"edges/current/{joint}", [seconds(times)], current, f"current of {joint}", color, 1.0)
            path, pulses = f"edges/voltage/{joint}", edges.voltage[:, :, j].T.reshape(-1, 3)[lasts, 0]
            held = rr.components.InterpolationMode.StepAfter
            stream.keep(path, rr.SeriesLines(names=[f"voltage of {joint}"], colors=[color], interpolation_mode=held))
            stream.curves(path, [seconds(times[::3])], pulses)


def _signals(stretch: WatchedStretch) -> dict[str, Array]:
    """Return the curves of a stretch, by path."""
    planned = stretch.reference
    asked = {"torque/command": stretch.command, "torque/disturbance": stretch.tau - stretch.command}
    return {
        "q/planned": planned.q,
        "q/true": stretch.q,
        "q/measured": stretch.measured,
        "qd/planned": planned.qd,
        "qd/true": stretch.qd,
        "qdd/planned": planned.qdd,
        "error/tracking": planned.q - stretch.q,
        "error/encoder": stretch.measured - stretch.q,
        "torque/true": stretch.tau,
        "torque/log": stretch.logged,
        **({} if stretch.by_position else asked),
        **({} if stretch.gap is None else {"gear/gap": stretch.gap}),
    }
