"""The recording of servos: commands, measured and simulated positions, and residuals."""

from collections.abc import Mapping

import numpy as np

from idbench.experiments.recording.audience import Audience
from idbench.experiments.recording.folder import BASE
from idbench.experiments.recording.identification_recording import recording_id
from idbench.experiments.recording.motion_layer import Base
from idbench.experiments.recording.stream import Stream, part, seconds
from idbench.experiments.text import FORMS, GREY
from idbench.identify import Array
from idbench.identify.files.servo_log import ServoColumns
from idbench.identify.servo.rows import smoothed
from idbench.sim.robot.robot import Robot

COMMANDED = [200, 160, 60]  # Colour of commands


def record_servos(
    robot: Robot, name: str, log: ServoColumns, simulated: Mapping[str, Array], head: str, audience: Audience | None = None
) -> list[tuple[str, Stream]]:
    """Return the stream of the recording of a log, by the name of its file.

    `head` is what the fit comes to; `simulated` are the positions of the joints with an estimate, from commands alone [rad], by
    joint, shape (time,) each.
    """
    _, qd, _ = smoothed(log.t, log.q)
    fs = 1 / float(np.median(np.diff(log.t)))
    base = Base(recording_id(name, np.ascontiguousarray(log.q).tobytes()), robot, fs, ("measured",), qd, audience)
    base.add(0, {"q/measured": log.q}, {"measured": log.q}, qd)
    times = [seconds(log.t - log.t[0])]
    for joint, q in simulated.items():
        j, path = robot.joints.index(joint), f"servo/{part(joint)}"
        curves = (("command", log.command[:, j], COMMANDED, 1.0), ("measured", log.q[:, j], GREY, 2.0),
                  ("simulated", q, FORMS["explicit"], 1.5))  # fmt: skip
        for kind, values, color, width in curves:
            base.stream.curve(f"{path}/q/{kind}", times, values, f"{kind} {joint}", color, width)
        base.stream.curve(f"{path}/residual", times, log.q[:, j] - q, f"measured - simulated {joint}", GREY, 1.5)
    base.finish(
        f"{head}\n\nSimulated from the commands of {name} alone. Yellow: commanded. Grey: measured. Third curve: simulated."
    )
    return [(BASE, base.stream)]
