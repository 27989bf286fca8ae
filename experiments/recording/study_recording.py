"""The recording of a study: errors over the values of its axes, their distribution, and the worst runs."""

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import rerun as rr

from idbench.experiments.recording.audience import Audience
from idbench.experiments.recording.chart import NARROW, SYMBOLS, Chart, Symbol
from idbench.experiments.recording.folder import BASE
from idbench.experiments.recording.layouts import tabs
from idbench.experiments.recording.scales import Words, decades, linear, named
from idbench.experiments.recording.stream import Stream, part
from idbench.experiments.study.answer import command, in_words, short, where, worst_runs
from idbench.experiments.study.axis import Axis
from idbench.experiments.study.ratios import study_answer, study_conclusion
from idbench.experiments.study.statistics import MIN_ERROR, Cell
from idbench.experiments.study.study import Study
from idbench.experiments.text import FORMS, GREY, JOINTS, Color, lighter
from idbench.identify import Array

PERCENT = 100.0  # of a share
DOTS = 150  # Runs of a cell that are drawn
MANY = 5  # Values of an axis from which on a small chart writes some only
BESIDE = 0.5  # Share of the room of an axis' value over which models and ways stand beside each other

WORST: Color = (255, 255, 255)

Worst = tuple[Cell, str, float, int, str]
"""A run: its cell, parameter and error, its number, and the command that makes it again."""


@dataclass(frozen=True, eq=False)
class AxisCharts:
    """The charts over one axis."""

    stream: Stream
    """Where they go."""
    axis: Axis
    """The axis."""
    cells: Sequence[Cell]
    """Those that have runs."""

    def send(self, worst: Sequence[Worst]) -> None:
        """Send the typical error, and that of every parameter with its runs, the worst of them by name."""
        path, typical = f"study/{part(self.axis.field)}", [PERCENT * cell.typical for cell in self.cells]
        chart = Chart(self.stream, f"{path}/typical", self._x, decades("typical error [%]", typical))
        for line in self._lines.values():
            self._draw(chart, line, np.array([PERCENT * cell.typical for cell in line]))
            others = [in_words(v) for name, v in line[0].settings.items() if name != self.axis.field]
            if others and line[0].names[2] == self._models[0]:  # they stand at the end of lines, of the first model only
                at = np.array([self._place(line[-1])]), np.array([PERCENT * line[-1].typical])
                chart.write(f"others/{'_'.join([*line[0].names, *others])}", *at, [", ".join(others)])
        for name, color in self._legend.items():
            chart.list_entry(name, color)
        for p, name in enumerate(self.cells[0].parameters):
            if all(cell.relative[p] for cell in self.cells):
                self._parameter(f"{path}/parameters/{p:02}/{part(name)}", p, [w for w in worst if w[1] == name])

    @property
    def _x(self) -> Words:
        return named(short(self.axis.field), [in_words(self.axis.label(v)) for v in self.axis.points])

    @cached_property
    def _lines(self) -> dict[tuple[Any, ...], list[Cell]]:
        """The cells that differ in this axis alone."""
        lines: dict[tuple[Any, ...], list[Cell]] = {}
        for cell in self.cells:
            others = [str(x) for name, x in cell.settings.items() if name != self.axis.field]
            lines.setdefault((*cell.names, *others), []).append(cell)
        return lines

    @cached_property
    def _ways(self) -> list[tuple[str, str]]:
        return list(dict.fromkeys(cell.names[:2] for cell in self.cells))

    @cached_property
    def _models(self) -> list[str]:
        return list(dict.fromkeys(cell.names[2] for cell in self.cells))

    @property
    def _legend(self) -> Mapping[str, Color]:
        signs = {way: f"{_SIGNS[self._symbol(way)]} {' '.join(way)}" for way in self._ways if len(self._ways) > 1}
        if self._alone:
            return {sign: self._color((*way, self._models[0])) for way, sign in signs.items()}
        return {model: FORMS.get(model, GREY) for model in self._models} | dict.fromkeys(signs.values(), GREY)

    @property
    def _alone(self) -> bool:
        """Whether there is one model, so that colours can tell ways of identification apart."""
        return len(self._models) == 1 and len(self._ways) > 1

    def _color(self, names: tuple[str, str, str]) -> Color:
        """Return the colour of what has a chain, an estimator and a model."""
        if self._alone:
            return JOINTS[self._ways.index(names[:2]) % len(JOINTS)]
        return FORMS.get(names[2], GREY)

    def _symbol(self, way: tuple[str, str]) -> Symbol:
        return SYMBOLS[self._ways.index(way) % len(SYMBOLS)]

    def _place(self, cell: Cell) -> float:
        """Place of a cell on the axis: models and ways beside each other, at the value."""
        places = len(self._models) * len(self._ways)
        mine = self._models.index(cell.names[2]) * len(self._ways) + self._ways.index(cell.names[:2])
        values = [self.axis.label(v) for v in self.axis.points]
        return values.index(cell.settings[self.axis.field]) + BESIDE * ((mine + 0.5) / places - 0.5)

    def _draw(self, chart: Chart, line: Sequence[Cell], y: Array) -> None:
        x, color = np.array([self._place(cell) for cell in line]), self._color(line[0].names)
        name = "_".join([*line[0].names, *(in_words(v) for k, v in line[0].settings.items() if k != self.axis.field)])
        chart.line(name, x, y, color, listed=False)
        chart.marks(name, x, y, color, self._symbol(line[0].names[:2]))

    def _parameter(self, path: str, p: int, worst: Sequence[Worst]) -> None:
        """Send the rms error of a parameter, its runs as dots, and the worst of them."""
        sizes = [np.maximum(PERCENT * np.abs(cell.error[:, p]), PERCENT * MIN_ERROR) for cell in self.cells]
        low = np.concatenate([np.quantile(size, [0.02, 1.0]) for size in sizes])  # errors pass through 0
        words = [word if k % (1 + len(self._x.words) // MANY) == 0 else "" for k, word in enumerate(self._x.words)]
        chart = Chart(self.stream, path, named("", words), decades("error [%]", low), NARROW)
        for cell, size in zip(self.cells, sizes, strict=True):
            some = size[:: max(1, len(size) // DOTS)]
            name = "_".join([*cell.names, *map(in_words, cell.settings.values())])
            chart.dots(name, np.full(len(some), self._place(cell)), some, lighter(self._color(cell.names), 1))
        for line in self._lines.values():
            self._draw(chart, line, np.array([PERCENT * cell.rmse[p] for cell in line]))
        self._worst(chart, path, worst)

    def _worst(self, chart: Chart, path: str, worst: Sequence[Worst]) -> None:
        """Mark the worst runs, by their number, with the command that makes them again; none where they are others'."""
        x = np.array([self._place(cell) for cell, *_ in worst])
        y = np.array([PERCENT * abs(error) for _, _, error, _, _ in worst])
        chart.marks("worst", x, y, WORST)
        if worst:  # one label: those of others would lie on it
            k = int(y.argmax())
            width = len(self._x.words)
            inside = np.clip(x[k : k + 1], LABEL * width - 0.5, (1 - LABEL) * width - 0.5)  # or the axis' numbers were covered
            chart.write("worst", inside, y[k : k + 1], [f"run {worst[k][-2]}"])
        self.stream.keep(f"{path}/marks/worst", rr.AnyValues(commands=[command for *_, command in worst] or ["none"]))


_SIGNS: dict[Symbol, str] = {"square": "□", "triangle": "△", "diamond": "◇", "cross": "x", "circle": "o"}

EDGES = np.arange(-6.25, 6.3, 0.5)  # Bins of errors in sigma; what lies beyond counts in the outermost

TYPICAL = "*Typical error: geometric mean, over the parameters, of the rms error of all runs.*"

LABEL = 0.2  # Share of an axis that half of a run's label takes
LISTED = 5  # Worst runs that have room beside the charts
EVERY = 2.0  # Least time between two drawings for who watches [s]
REST = 10.0  # The same, as a multiple of what the last drawing took: all runs are drawn anew each time


class StudyRecording:
    """The recording of a study kept in a folder: drawn again and again while it runs, and kept when it has ended."""

    def __init__(self, study: Study, folder: Path, audience: Audience | None = None) -> None:
        self._study = study
        self._folder = folder
        self._next = 0.0
        self._shown = set[str]()
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
        worst = [(c, name, e, r, command(self._study, self._folder, c, r)) for c, name, e, r in worst_runs(solved)]
        self.stream.page("answer", _text(self._study, cells, worst))
        if not solved:
            return
        for axis in self._study.every_axis:
            if len(axis.points) > 1:
                AxisCharts(self.stream, axis, solved).send(worst)
        _send_sigmas(self.stream, solved)


def _send_sigmas(stream: Stream, cells: Sequence[Cell]) -> None:
    """Send the distribution of all errors over their standard errors, a line a model, beside the normal one."""
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
    chart.line("normal", middle, normal, GREY, 3.0)
    for model, share in shares.items():
        chart.line(model, middle, share, FORMS.get(model, GREY))


def _text(study: Study, cells: Sequence[Cell], worst: Sequence[Worst]) -> str:
    lines = [f"- {name} {100 * e:+.2g} %: {where(cell, cells)}\n  `{again}`" for cell, name, e, _, again in worst[:LISTED]]
    first = study_conclusion(study, cells, "").finding
    parts = [f"# {study.question}", f"**{first}**", study_answer(study, cells), TYPICAL, "## Worst runs", "\n".join(lines)]
    return "\n\n".join(parts)
