"""The recording of a designed motion: the arm along it, limits in use, and which stretch excites which parameter."""

import numpy as np

from idbench.experiments.excite.excitation import REST
from idbench.experiments.excite.excited import STRETCHES, Excited
from idbench.experiments.excite.limit_use import FS
from idbench.experiments.recording.audience import Audience
from idbench.experiments.recording.chart import MAX_ROWS, SQUARE, Chart, in_charts
from idbench.experiments.recording.folder import BASE
from idbench.experiments.recording.identification_recording import recording_id
from idbench.experiments.recording.motion_layer import Base
from idbench.experiments.recording.scales import decades, linear, listed
from idbench.experiments.recording.stream import Stream, part, seconds
from idbench.experiments.reports.excite import lines
from idbench.experiments.text import FORMS, GREY, Color, joint_colors
from idbench.sim.scenario.scenario_file import to_toml

SHOWN = 50.0  # Frequency [Hz] of the curves

DARK, BRIGHT = np.array([32.0, 32.0, 36.0]), np.array([90.0, 200.0, 120.0])
"""Colours of cells: of a stretch without information, and of the most informative one."""

LEVELS = 8  # Colours that can be distinguished: an entity each, where one for each cell would make a large recording
NOTABLE = 0.2  # Largest share of a limit below which it is not shown: it is in nobody's way


def record_excited(found: Excited, audience: Audience | None = None) -> list[tuple[str, Stream]]:
    """Return the stream of the recording, by the name of its file."""
    scenario, robot = found.scenario, found.design.robot_model.robot
    _, motion = found.planned(SHOWN)
    base = Base(recording_id(scenario.name, to_toml(scenario).encode()), robot, SHOWN, ("planned",), motion.qd, audience)
    base.stream.describe(scenario=to_toml(scenario), seed=str(found.design.seed), fs_hz=f"{scenario.fs:g}")
    base.arm.trace(motion.q)
    curves = {"q/designed": motion.q, "qd/designed": motion.qd, "qdd/designed": motion.qdd}
    base.add(0, curves, {"planned": motion.q}, motion.qd)
    _send_limits(base.stream, found)
    _send_sigmas(base.stream, found)
    _send_told(base.stream, found)
    base.finish("\n\n".join(["## Designed motion", *lines(found)]))
    return [(BASE, base.stream)]


def _send_limits(stream: Stream, found: Excited) -> None:
    """Send which share of each limit the motion uses over time, from the end of the way on."""
    step, joints = round(FS / SHOWN), [part(joint) for joint in found.use.joints]
    begin = len(found.ways[0].q) / FS
    for number, (kind, share) in enumerate(found.use.shares.items()):
        if len(share) > 1 and share.max() > NOTABLE:
            path = f"limits/{number}_{part(kind)}"
            stream.style(path, [f"{kind} {joint}" for joint in joints], joint_colors(len(joints)))
            stream.curves(path, [seconds(begin + np.arange(len(share))[::step] / FS)], 100 * share[::step])


def _send_sigmas(stream: Stream, found: Excited) -> None:
    """Send predicted sigmas over those of the median random motion."""
    if not found.random:
        return
    names = found.design.robot_model.basis.names
    others = np.sort(found.sigmas[1:] / found.median, axis=0)
    x = decades("sigma relative to the median random motion", others, found.sigma / found.median)
    for at, members in in_charts(names, MAX_ROWS):
        chart = Chart(stream, f"excited/sigma/{at}", x, listed("", [names[p] for p in members]), SQUARE)
        y = np.arange(float(len(members)))
        chart.intervals("random", others[0, members], others[-1, members], y, GREY, 3.0)
        chart.list_entry("random motions", GREY)
        chart.marks("this motion", (found.sigma / found.median)[members], y, FORMS["explicit"])
        chart.list_entry("this motion", FORMS["explicit"])


def _send_told(stream: Stream, found: Excited) -> None:
    """Send the share of each stretch of the motion in the information about each parameter."""
    names, shares, duration = found.design.robot_model.basis.names, found.shares, found.design.duration
    begin = len(found.ways[0].q) / FS + REST
    middles = begin + (np.arange(STRETCHES) + 0.5) * duration / STRETCHES
    for at, members in in_charts(names, MAX_ROWS):
        x = linear("time [s]", begin, begin + duration)
        chart = Chart(stream, f"excited/told/{at}", x, listed("", [names[p] for p in members]))
        strength = np.clip(shares[:, members] / shares[:, members].max(axis=0), 0.0, 1.0)
        level, row = np.rint((LEVELS - 1) * strength.T).astype(int), np.arange(float(len(members)))
        for k in range(LEVELS):
            which, stretch = np.nonzero(level == k)
            begins, ends = (middles[stretch] + half * duration / STRETCHES for half in (-0.46, 0.46))
            color: Color = [int(v) for v in DARK + (BRIGHT - DARK) * k / (LEVELS - 1)]
            chart.intervals(f"level {k}", begins, ends, row[which], color, 5.0)
