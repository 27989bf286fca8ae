"""The recording of a study: every run's errors, their distribution, and the worst runs."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import rerun as rr

from experiments.recording.audience import Audience
from experiments.recording.columns import numbers
from experiments.recording.folder import BASE
from experiments.recording.layouts import tabs
from experiments.recording.stream import Stream
from experiments.recording.style import FORMS, GREY
from experiments.study.answer import answer, where
from experiments.study.statistics import Cell
from experiments.study.study import Study
from experiments.study.study_report import command, worst_runs

EDGES = np.arange(-6.25, 6.3, 0.5)
"""Bins of errors in sigma; what lies beyond counts in the outermost."""


class StudyRecording:
    """The recording of a study: points while it runs, the rest when it has ended.

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
        self._study, self._folder = study, folder
        self.stream = Stream(f"study-{study.name}-{study.fingerprint[:10]}", audience)
        for model in study.models:
            size = 2.0 * (len(study.models) - study.models.index(model))
            for name in study.parameters:
                points = rr.SeriesPoints(names=model, colors=FORMS.get(model, GREY), marker_sizes=size)
                self.stream.keep(f"runs/{name}/{model}", points)
        self.stream.show(tabs(self.stream.paths))

    def add(self, cells: Sequence[Cell]) -> None:
        """Send the errors of runs, each a point."""
        for cell in cells:
            order, errors = np.argsort(cell.run, kind="stable"), 100 * cell.error
            for p, name in enumerate(cell.parameters if cell.runs else ()):
                self.stream.curves(f"runs/{name}/{cell.names[2]}", [numbers("run", cell.run[order])], errors[order, p])
        self.stream.breathe(0.0)

    def finish(self, cells: Sequence[Cell]) -> list[tuple[str, Stream]]:
        """Send the answer, and the distributions of the errors; return the stream by the name of its file."""
        text = rr.TextDocument(_text(self._study, cells, self._folder), media_type=rr.MediaType.MARKDOWN)
        self.stream.keep("answer", text)
        for model in self._study.models:
            if mine := [cell for cell in cells if cell.runs and cell.names[2] == model]:
                _sigmas(self.stream, model, mine)
        self.stream.arrange(tabs(self.stream.paths))
        return [(BASE, self.stream)]


def _sigmas(stream: Stream, model: str, cells: Sequence[Cell]) -> None:
    """Send the histogram of all errors over their corrected sigma."""
    z = np.concatenate([((c.X - c.truth)[c.sigma > 0] / c.sigma[c.sigma > 0]) for c in cells])
    color = FORMS.get(model, GREY)
    counts, _ = np.histogram(np.clip(z, EDGES[0], EDGES[-1]), EDGES)
    bars = rr.BarChart(counts / max(counts.sum(), 1), abscissa=(EDGES[:-1] + EDGES[1:]) / 2, widths=np.diff(EDGES), color=color)
    stream.keep(f"sigmas/{model}", bars)


def _text(study: Study, cells: Sequence[Cell], folder: Path) -> str:
    worst = [
        f"- {name} {100 * e:+.2g} %: {where(cell, cells)}\n  `{command(study, folder, cell, run)}`"
        for cell, name, e, run in worst_runs([cell for cell in cells if cell.runs])
    ]
    return "\n\n".join([f"# {study.question}", answer(cells), "## Worst runs", "\n".join(worst)])
