"""The recording of a study: every run's errors, their distribution, and the worst runs."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from experiments.audience import Audience
from experiments.recording.folder import BASE
from experiments.recording.stream import Stream
from experiments.recording.style import FORMS, GREY
from experiments.study.answer import answer, where
from experiments.study.report import command, worst_runs
from experiments.study.statistics import Cell
from experiments.study.study import Study

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
                self.stream.keep(f"error/{name}/{model}", points)
        self.stream.arrange(_blueprint(study))

    def add(self, cells: Sequence[Cell]) -> None:
        """Send the errors of runs, each a point."""
        for cell in cells:
            order, errors = np.argsort(cell.run, kind="stable"), 100 * cell.error
            for p, name in enumerate(cell.parameters if cell.runs else ()):
                columns = rr.Scalars.columns(scalars=errors[order, p])
                self.stream.send(f"error/{name}/{cell.names[2]}", [rr.TimeColumn("run", sequence=cell.run[order])], columns)
        self.stream.breathe(0.0)

    def finish(self, cells: Sequence[Cell]) -> list[tuple[str, Stream]]:
        """Send the answer, and the distributions of the errors; return the stream by the name of its file."""
        text = rr.TextDocument(_text(self._study, cells, self._folder), media_type=rr.MediaType.MARKDOWN)
        self.stream.keep("report", text)
        for model in self._study.models:
            if mine := [cell for cell in cells if cell.runs and cell.names[2] == model]:
                _sigmas(self.stream, model, mine)
        self.stream.arrange(_blueprint(self._study, finished=True))
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


def _blueprint(study: Study, *, finished: bool = False) -> rrb.Blueprint:
    hidden = rrb.PlotLegend(visible=False)  # the colours are those of the histograms
    errors = [
        rrb.TimeSeriesView(origin=f"/error/{name}", name=f"error of {name} [%] over runs", plot_legend=hidden)
        for name in study.parameters
    ]
    sigmas = [
        rrb.BarChartView(origin=f"/sigmas/{name}", name=f"{name}: error / corrected sigma", plot_legend=hidden)
        for name in study.models
    ]
    text = rrb.TextDocumentView(origin="/report", name=study.name)
    left = [rrb.Vertical(text, *sigmas, row_shares=[2.0, *[1.0] * len(sigmas)])] if finished else []
    time, shares = rrb.TimePanel(state="collapsed", timeline="run"), [*[1.0] * len(left), 2.0]
    points = rrb.Grid(*errors, grid_columns=2)
    return rrb.Blueprint(rrb.Horizontal(*left, points, column_shares=shares), time, collapse_panels=True)
