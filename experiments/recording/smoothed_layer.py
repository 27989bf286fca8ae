"""The motion that maximum likelihood finds, over the measured one."""

from collections.abc import Sequence

import numpy as np
import rerun as rr

from idbench.experiments.recording.columns import seconds
from idbench.experiments.recording.stream import Stream
from idbench.experiments.style import GREY, joint_colors
from idbench.identify import Array, JointFit, smoothed_motion


def send_smoothed(stream: Stream, at: str, fit: JointFit, joints: Sequence[str]) -> None:
    """Send the smoothed motion with its band of one sigma, and how far measured positions and their differences are from it.

    Parameters
    ----------
    stream : Stream
        Where to.
    at : str
        Path of the identification.
    fit : JointFit
        Motion and parameters of one log.
    joints : sequence of str
        Their names.
    """
    log, motion = fit.logs[0].log, smoothed_motion(fit)
    q = log.q[np.rint(motion.t * log.fs).astype(np.intp)]
    measured = {"q": q, "qd": np.gradient(q, 1 / log.fs, axis=0)}
    times = [seconds(motion.t)]
    for name, sigma in (("q", motion.sigma_q), ("qd", motion.sigma_qd), ("qdd", motion.sigma_qdd)):
        for joint, color, value, off in zip(joints, joint_colors(len(joints)), getattr(motion, name).T, sigma.T, strict=True):
            _send_band(stream, f"{at}/smoothed/{name}/{joint}", motion.t, value, off, color)
    for name, sigma in (("q", motion.sigma_q), ("qd", motion.sigma_qd)):
        for k, (joint, color) in enumerate(zip(joints, joint_colors(len(joints)), strict=True)):
            left = measured[name][:, k] - getattr(motion, name)[:, k]
            stream.style(f"{at}/measured_less_smoothed/{name}/{joint}", ["measured - smoothed"], [GREY], 1.0)
            stream.curves(f"{at}/measured_less_smoothed/{name}/{joint}", times, left)
            _send_band(stream, f"{at}/smoothed_band/{name}/{joint}", motion.t, 0 * left, sigma[:, k], color)


def _send_band(stream: Stream, path: str, t: Array, values: Array, sigma: Array, color: Sequence[int]) -> None:
    stream.keep(path, rr.Measurements.from_fields(names=["smoothed"], colors=[color], widths=[1.5]))
    stream.send(path, [seconds(t)], rr.Measurements.columns(values=values, variances=sigma**2))
