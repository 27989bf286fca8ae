"""The recording of a study: errors over the values of its axes, their distribution, and the worst runs."""

import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import rerun as rr

from idbench.experiments.recording.audience import Audience
from idbench.experiments.recording.chart import Chart
from idbench.experiments.recording.folder import BASE
from idbench.experiments.recording.layouts import tabs
from idbench.experiments.recording.scales import linear
from idbench.experiments.recording.stream import Stream
from idbench.experiments.recording.study_charts import AxisCharts
from idbench.experiments.study.answer import answer, where
from idbench.experiments.study.statistics import Cell
from idbench.experiments.study.study import Study
from idbench.experiments.study.study_report import command, worst_runs
from idbench.experiments.style import FORMS, GREY

EDGES = np.arange(-6.25, 6.3, 0.5)
"""Bins of errors in sigma; what lies beyond counts in the outermost."""

EVERY = 2.0
"""Least time between two drawings for who watches [s]."""

REST = 10.0
"""The same, as a multiple of what the last drawing took: all runs are drawn anew each time."""


class StudyRecording:
    """The recording of a study: drawn again and again while it runs, and kept when it has ended.

    Parameters
    ----------
    study : Study
        What is run.
    folder : Path
        Where it is kept.
    audience : Audience, optional
        Who watches.
    """

    def __init__(self, study: Study, folder: Path, audience: Audience | None = None) -> None:
        self._study, self._folder, self._next, self._shown = study, folder, 0.0, set[str]()
        self.stream = Stream(f"study-{study.name}-{study.fingerprint[:10]}", audience)

    @property
    def due(self) -> bool:
        """Whether it is time to draw again."""
        return time.monotonic() > self._next

    def show(self, cells: Sequence[Cell]) -> None:
        """Draw what is there so far for who watches."""
        began = time.monotonic()
        with self.stream.draft():
            self._draw(cells)
        if self._shown != self.stream.shown:  # a layout that comes again would take who watches back to its first tab
            self._shown = set(self.stream.shown)
            self.stream.show(tabs(self._shown))
        self.stream.breathe(0.0)
        now = time.monotonic()
        self._next = now + max(EVERY, REST * (now - began))

    def finish(self, cells: Sequence[Cell]) -> list[tuple[str, Stream]]:
        """Draw everything, to be kept; return the stream by the name of its file."""
        self._draw(cells)
        self.stream.arrange(tabs(self.stream.paths))
        return [(BASE, self.stream)]

    def _draw(self, cells: Sequence[Cell]) -> None:
        solved = [cell for cell in cells if cell.runs]
        worst = worst_runs(solved)
        written = rr.TextDocument(_text(self._study, cells, self._folder, worst), media_type=rr.MediaType.MARKDOWN)
        self.stream.keep("answer", written)
        if not solved:
            return
        for axis in self._study.every_axis:
            if len(axis.points) > 1:
                AxisCharts(self.stream, axis, solved).send([(c, name, e, r, command(self._study, self._folder, c, r))
                                                            for c, name, e, r in worst])  # fmt: skip
        _send_sigmas(self.stream, solved)


def _send_sigmas(stream: Stream, cells: Sequence[Cell]) -> None:
    """Send the distribution of all errors over their corrected sigma, a line a model, beside the normal one."""
    middle = (EDGES[:-1] + EDGES[1:]) / 2
    normal = np.exp(-(middle**2) / 2) / np.sqrt(2 * np.pi) * np.diff(EDGES)
    shares = {}
    for model in dict.fromkeys(cell.names[2] for cell in cells):
        mine = [c for c in cells if c.names[2] == model]
        z = np.concatenate([(c.X - c.truth)[c.sigma > 0] / c.sigma[c.sigma > 0] for c in mine])
        counts, _ = np.histogram(np.clip(z, EDGES[0], EDGES[-1]), EDGES)
        shares[model] = counts / max(counts.sum(), 1)
    x, y = linear("error over its sigma", EDGES), linear("share of all errors", np.zeros(1), normal, *shares.values())
    chart = Chart(stream, "study/sigmas", x, y)
    chart.line("as it should be", middle, normal, GREY, 3.0)
    for model, share in shares.items():
        chart.line(model, middle, share, FORMS.get(model, GREY))


def _text(study: Study, cells: Sequence[Cell], folder: Path, worst: Sequence[tuple[Cell, str, float, int]]) -> str:
    lines = [
        f"- {name} {100 * e:+.2g} %: {where(cell, cells)}\n  `{command(study, folder, cell, run)}`"
        for cell, name, e, run in worst
    ]
    return "\n\n".join([f"# {study.question}", answer(cells, study.edges), "## Worst runs", "\n".join(lines)])
