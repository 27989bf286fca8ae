"""Charts of iterations: the way that parameters take from where an estimator begins to where it ends."""

from math import ceil

import numpy as np

from idbench.experiments.identification.fit import Fit
from idbench.experiments.recording.chart import NARROW, Chart
from idbench.experiments.recording.columns import part
from idbench.experiments.recording.scales import Signed, Words
from idbench.experiments.recording.stream import Stream
from idbench.experiments.style import JOINTS
from idbench.identify import Estimate

LINEAR_UP_TO = 1e-3
"""Difference [sigma] up to which the axis is linear."""


def send_iterations(stream: Stream, at: str, fit: Fit) -> None:
    """Send, of estimators that go on from round to round, how far each parameter is from the last, in its sigma."""
    for model, estimate in fit.estimates.items():
        if len(estimate.path) > 1:
            _send(stream, f"{at}/iterations/{model}", estimate)


def _send(stream: Stream, at: str, estimate: Estimate) -> None:
    path = np.array(estimate.path)
    sigma = np.where(estimate.standard_errors > 0, estimate.standard_errors, 1.0)
    off, rounds = (path - estimate.X) / sigma, np.arange(float(len(path)))
    high = max(float(np.nanmax(np.abs(off))), 10 * LINEAR_UP_TO)
    scale = Signed("away from the last [sigma]", -1.3 * high, 1.3 * high, LINEAR_UP_TO)
    axis = Words("round", -0.5, len(path) - 0.5, tuple(map(str, range(len(path)))))
    names = np.array_split(np.arange(len(estimate.names)), ceil(len(estimate.names) / len(JOINTS)))  # a colour each
    for k, members in enumerate(names):
        place = f"{at}/{k}_{part(estimate.names[members[0]])}_to_{part(estimate.names[members[-1]])}"
        chart = Chart(stream, place, axis, scale, NARROW)
        for color, p in zip(JOINTS, members, strict=False):
            chart.line(estimate.names[p], rounds, off[:, p], color)
            chart.marks(f"{estimate.names[p]} ", rounds, off[:, p], color)
