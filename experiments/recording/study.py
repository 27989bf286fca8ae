"""The recording of a study: every run's errors, their distribution, and the worst runs."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from experiments.recording.stream import recording_file
from experiments.recording.style import FORMS, MEASURED
from experiments.study.answer import answer, where
from experiments.study.report import command, worst_runs
from experiments.study.statistics import Cell
from experiments.study.study import Study

EDGES = np.arange(-6.25, 6.3, 0.5)
"""Bins of errors in sigma; what lies beyond counts in the outermost."""


def record_study(path: Path, study: Study, cells: Sequence[Cell], folder: Path) -> None:
    """Record the errors of every run over its number, and their distribution in units of sigma."""
    solved = [cell for cell in cells if cell.runs]
    with recording_file(path, f"study-{study.name}", _blueprint(study)) as recording:
        recording.log("/report", rr.TextDocument(_text(study, cells, folder), media_type=rr.MediaType.MARKDOWN), static=True)
        for model in study.models:
            size = 2.0 * (len(study.models) - study.models.index(model))
            _errors(recording, model, [cell for cell in solved if cell.names[2] == model], size)


def _errors(recording: rr.RecordingStream, model: str, cells: Sequence[Cell], size: float) -> None:
    """Send a point a run and parameter, and the histogram of all errors over their corrected sigma."""
    if not cells:
        return
    run = np.concatenate([cell.run for cell in cells])
    error = 100 * np.concatenate([cell.error for cell in cells])
    order, color = np.argsort(run, kind="stable"), FORMS.get(model, MEASURED)
    for p, name in enumerate(cells[0].parameters):
        at = f"/error/{name}/{model}"
        recording.log(at, rr.SeriesPoints(names=model, colors=color, marker_sizes=size), static=True)
        recording.send_columns(at, [rr.TimeColumn("run", sequence=run[order])], rr.Scalars.columns(scalars=error[order, p]))
    z = np.concatenate([((c.X - c.truth)[c.sigma > 0] / c.sigma[c.sigma > 0]) for c in cells])
    counts, _ = np.histogram(np.clip(z, EDGES[0], EDGES[-1]), EDGES)
    bars = rr.BarChart(counts / max(counts.sum(), 1), abscissa=(EDGES[:-1] + EDGES[1:]) / 2, widths=np.diff(EDGES), color=color)
    recording.log(f"/sigmas/{model}", bars, static=True)


def _text(study: Study, cells: Sequence[Cell], folder: Path) -> str:
    worst = [
        f"- {name} {100 * e:+.2g} %: {where(cell, cells)}\n  `{command(study, folder, cell, run)}`"
        for cell, name, e, run in worst_runs([cell for cell in cells if cell.runs])
    ]
    return "\n\n".join([f"# {study.question}", answer(cells), "## Worst runs", "\n".join(worst)])


def _blueprint(study: Study) -> rrb.Blueprint:
    hidden = rrb.PlotLegend(visible=False)  # the colours are those of the histograms
    errors = [
        rrb.TimeSeriesView(origin=f"/error/{name}", name=f"error of {name} [%] over runs", plot_legend=hidden)
        for name in study.parameters
    ]
    sigmas = [rrb.BarChartView(origin=f"/sigmas/{name}", name=f"{name}: error / corrected sigma") for name in study.models]
    left = rrb.Vertical(
        rrb.TextDocumentView(origin="/report", name=study.name), *sigmas, row_shares=[2.0, *[1.0] * len(sigmas)]
    )
    time = rrb.TimePanel(state="collapsed", timeline="run")
    return rrb.Blueprint(
        rrb.Horizontal(left, rrb.Grid(*errors, grid_columns=2), column_shares=[1.0, 2.0]), time, collapse_panels=True
    )
