"""The recording of a designed motion: the arm along it, and limits in use."""

import numpy as np

from idbench.experiments.excite.excited import Excited
from idbench.experiments.excite.limit_use import FS
from idbench.experiments.recording.audience import Audience
from idbench.experiments.recording.folder import BASE
from idbench.experiments.recording.identification_recording import recording_id
from idbench.experiments.recording.motion_layer import Base
from idbench.experiments.recording.stream import Stream, part, seconds
from idbench.experiments.reports.excite import lines
from idbench.experiments.text import joint_colors
from idbench.sim.scenario.scenario_file import to_toml

SHOWN = 50.0  # Frequency [Hz] of the curves

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
