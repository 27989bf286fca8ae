"""The figures of a study's report, as SVG."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes as Panel
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure

from idbench.experiments.reports.drawn import svg
from idbench.experiments.study.answer import in_words
from idbench.experiments.study.axis import Axis
from idbench.experiments.study.statistics import RIGHT, Cell
from idbench.experiments.text import FORMS, SIGMAS
from idbench.identify import Array

OTHER = [90, 90, 90]  # Colour of models that have none of their own
MANY = 16  # Parameters beyond which one picture shows all of them, instead of a panel each
ACROSS = 3  # Panels beside each other
TICKS, SMALL_TICKS = 8, 4  # Values of an axis that have room beside it, of a large panel and of a small one
PANEL = 2.2  # Height of a panel [inch]
REACH = 4.0  # How far panels of error bars reach, over the median of the bars
WIDE = 8.0  # Ratio of the largest to the smallest value above which an axis is logarithmic


def typical_figure(families: Mapping[str, Sequence[Cell]], axis: Axis, edges: int) -> str:
    """Return the typical error over an axis, a panel a family of cells, a line a model, with intervals."""
    columns = min(ACROSS, len(families))
    rows = -(-len(families) // columns)
    figure = Figure(figsize=(11, 2.6 * rows + 0.9), layout="constrained")
    grid = np.atleast_1d(figure.subplots(rows, columns, sharex=True, sharey=True)).ravel()
    for spare in grid[len(families) :]:
        spare.set_visible(False)
    for panel, (title, cells) in zip(grid, families.items(), strict=False):
        for model, group, x, style in _curves(panel, cells, axis, edges, TICKS):
            y = np.array([100 * c.typical for c in group])
            ends = np.abs(100 * np.array([c.typical_interval for c in group]).T - y)
            panel.errorbar(x, y, ends, **style, label=model, marker=".", capsize=2)
            if np.isfinite(least := np.array([100 * c.typical_least() for c in group])).any():
                panel.plot(x, least, color="black", ls=":", lw=1.0, label="bound")
        panel.set_yscale("log")
        panel.set_title(title)
    named = {label: handle for panel in grid for handle, label in zip(*panel.get_legend_handles_labels(), strict=True)}
    figure.legend(named.values(), named.keys(), loc="outside upper center", ncols=6, frameon=False)
    figure.supylabel("typical error [%]", fontsize=9)
    figure.supxlabel(axis.field, fontsize=9)
    return svg(figure)


def named_figure(families: Mapping[str, Sequence[Cell]], axis: Axis) -> str:
    """Share of the runs whose fault is named as one picture, a row a family of cells, a column a value of an axis."""
    columns = [axis.label(value) for value in axis.points]
    named = ({cell.settings[axis.field]: 100 * cell.named_share[0] for cell in cells} for cells in families.values())
    shares = np.array([[row.get(column, np.nan) for column in columns] for row in named])
    return svg(matrix([*families], list(map(in_words, columns)), shares, "runs whose fault is named [%]", log=False))


def error_figure(cells: Sequence[Cell], axis: Axis) -> str:
    """Return spread and bias of every parameter against an axis, a curve a model; of many parameters their rms error."""
    if len(cells[0].parameters) > MANY:
        values = 100 * np.array([cell.rmse for cell in cells])
        return svg(matrix(_rows_of(cells, axis), cells[0].parameters, values, "rms error [%]"))
    figure, panels = _panels(cells[0].parameters)
    for p, panel in enumerate(panels.values()):
        for model, group, x, style in _curves(panel, cells, axis):
            panel.plot(x, [100 * c.deviation[p] for c in group], **style, label=f"{model}: spread", marker=".")
            bias = np.array([100 * abs(c.bias[p]) for c in group])
            panel.plot(x, bias, **style, ls=":", label=f"{model}: |bias|")
            sure = np.array([abs(c.bias[p]) > c.bias_margin[p] for c in group])
            panel.plot(x[sure], bias[sure], "o", color=style["color"], ms=3)
        if any((np.asarray(line.get_ydata()) > 0).any() for line in panel.lines):  # a truth of 0 has no relative error
            panel.set_yscale("log")
    return svg(_finished(figure, panels, axis.field, "error [%]"))


def coverage_figure(cells: Sequence[Cell], axis: Axis) -> str:
    """Return the share of truths within two sigma against an axis: corrected, and the paper's; of many parameters corrected."""
    if len(cells[0].parameters) > MANY:
        values = 100 * np.array([cell.coverage(cell.sigma) for cell in cells])
        title = f"truth within {SIGMAS:g} sigma [%]"
        return svg(matrix(_rows_of(cells, axis), cells[0].parameters, values, title, log=False))
    figure, panels = _panels(cells[0].parameters)
    for p, panel in enumerate(panels.values()):
        panel.axhline(100 * RIGHT, color="black", lw=1.0, ls="--")
        for model, group, x, style in _curves(panel, cells, axis):
            low, high = (np.array([100 * c.coverage_interval(c.sigma)[p, i] for c in group]) for i in (0, 1))
            panel.plot(x, [100 * c.coverage(c.sigma)[p] for c in group], **style, label=f"{model}: corrected", marker=".")
            panel.fill_between(x, low, high, color=style["color"], alpha=0.08, lw=0)
            paper = [100 * c.coverage(c.paper_sigma)[p] for c in group]
            panel.plot(x, paper, **style, ls=":", label=f"{model}: paper's")
        panel.set_ylim(-3, 103)
    return svg(_finished(figure, panels, axis.field, f"truth within {SIGMAS:g} sigma [%]"))


def matrix(rows: Sequence[str], columns: Sequence[str], values: Array, title: str, *, log: bool = True) -> Figure:
    """Return numbers as one picture: a row each of `rows`, a column each of `columns`, a colour a number."""
    figure = Figure(figsize=(12, 1.4 + 0.24 * len(rows)), layout="constrained")
    panel: Any = figure.subplots()
    shown = np.where(values > 0, values, np.nan) if log else values
    norm = LogNorm() if log and np.isfinite(shown).any() else None
    image = panel.imshow(shown, aspect="auto", cmap="viridis", norm=norm)
    panel.set_yticks(range(len(rows)), rows)
    panel.set_xticks(range(len(columns)), columns, rotation=90, fontsize=7)
    panel.grid(visible=False)
    figure.colorbar(image, ax=panel, label=title)
    return figure


def _rows_of(cells: Sequence[Cell], axis: Axis) -> list[str]:
    return [f"{in_words(cell.settings[axis.field])} {cell.names[2]}" if cell.settings else cell.names[2] for cell in cells]


def bars_figure(cells: Sequence[Cell]) -> str:
    """Return mean and standard deviation of every parameter's error, a bar a method; of many parameters their rms errors."""
    names, parameters = [_name(cell, cells) for cell in cells], cells[0].parameters
    if len(parameters) > MANY:
        return svg(matrix(names, parameters, 100 * np.array([cell.rmse for cell in cells]), "rms error [%]"))
    numbers = ([cell.bias for cell in cells], [cell.deviation for cell in cells], [cell.least() for cell in cells])
    return svg(bars(names, parameters, *(100 * np.array(x) for x in numbers), runs=max(cell.runs for cell in cells)))


def bars(names: Sequence[str], parameters: Sequence[str], mean: Array, spread: Array, least: Array, *, runs: int) -> Figure:
    """Return mean and standard deviation of errors [%], shape (method, parameter), against the least that noise allows.

    Of few `runs`, a standard deviation may lie below what noise allows on average. A panel reaches as far as four times the
    median of the bars; what is beyond points there.
    """
    figure, panels = _panels(parameters, below=1.1, gap=0.65)
    at, spread = np.arange(len(names)), np.nan_to_num(spread)
    words = f"mean and standard deviation of the errors of {runs} runs"
    for p, panel in enumerate(panels.values()):
        sizes = (np.abs(mean[:, p]) + spread[:, p])[np.isfinite(mean[:, p])]
        limit = REACH * float(np.median(sizes)) if len(sizes) and np.median(sizes) > 0 else 1.0
        panel.axhline(0.0, color="black", lw=0.6)
        if np.isfinite(least[:, p]).any():
            bound = float(np.nanmean(least[:, p]))
            panel.axhspan(
                -bound, bound, color="0.8", lw=0, label="bound: least standard deviation that noise allows, on average"
            )
        inside, beyond = np.abs(mean[:, p]) < limit, np.abs(mean[:, p]) >= limit  # neither where there is no estimate
        shown = at[inside], mean[inside, p], spread[inside, p]
        panel.errorbar(*shown, fmt="o", ms=3, lw=1.2, capsize=2, color="#5b7db1", label=words)
        for x, y in zip(at[beyond], mean[beyond, p], strict=True):
            high, side = 0.93 * limit * np.sign(y), "left" if x < at[-1] / 2 else "right"
            panel.plot(x, high, "^" if y > 0 else "v", ms=4, color="#b15b5b", label="beyond the axis, with its value")
            panel.text(x, 0.8 * high, f"{y:.2g}", fontsize=6, color="#b15b5b", va="center", ha=side)
        panel.set_ylim(-limit, limit)
        panel.set_xticks(at, names, rotation=90, fontsize=6)
        panel.tick_params(labelbottom=True)
    return _finished(figure, panels, "", "error [%]")


def _name(cell: Cell, cells: Sequence[Cell]) -> str:
    """Name of a method beside others: its estimator, and chain and model where they differ."""
    words = [cell.names[1]]
    words += [cell.names[0]] if len({other.names[0] for other in cells}) > 1 and cell.names[0] != cells[0].names[0] else []
    words += [cell.names[2]] if len({other.names[2] for other in cells}) > 1 else []
    return " ".join(words)


def cost_figure(seconds: dict[str, float], runs: int) -> str:
    """Picture of the time of a run, in simulation and in each method."""
    if not seconds:
        return ""
    figure = Figure(figsize=(7, 0.6 + 0.3 * len(seconds)), layout="constrained")
    panel: Any = figure.subplots()
    values = [1e3 * s / max(runs, 1) for s in seconds.values()]
    bars = panel.barh(list(seconds), values, color="#5b7db1")
    panel.bar_label(bars, [f" {v:.3g} ms" for v in values])
    panel.set_xscale("log")
    panel.set_xlim(right=4 * max(values))
    panel.set_xlabel("time of a run on one thread [ms]")
    panel.invert_yaxis()
    return svg(figure)


def _panels(parameters: Sequence[str], below: float = 0.6, gap: float = 0.3) -> tuple[Figure, dict[str, Panel]]:
    columns = 4
    rows = -(-len(parameters) // columns)
    height = PANEL * rows + 0.9
    figure = Figure(figsize=(11, height))
    grid = np.atleast_1d(figure.subplots(rows, columns, sharex=True)).ravel()
    # By hand: a layout that is solved for draws everything twice.
    figure.subplots_adjust(0.06, below / height, 0.99, 1 - 0.6 / height, wspace=0.25, hspace=gap)
    for spare in grid[len(parameters) :]:
        spare.set_visible(False)
    return figure, dict(zip(parameters, grid, strict=False))


def _curves(
    panel: Panel, cells: Sequence[Cell], axis: Axis, edges: int = 4, ticks: int = SMALL_TICKS
) -> Iterator[tuple[str, list[Cell], Array, dict[str, Any]]]:
    """Yield each model, its cells, their places on an axis, and how curves look.

    Those drawn first are wider, and show beneath others that they agree with.
    """
    groups: dict[str, list[Cell]] = {}
    for cell in cells:
        groups.setdefault(cell.names[2], []).append(cell)
    for k, (model, group) in enumerate(groups.items()):
        color = tuple(c / 255 for c in FORMS.get(model, OTHER))
        yield model, group, _places(panel, group, axis, edges, ticks), {"color": color, "lw": 1.2 * (len(groups) - k)}


def _places(panel: Panel, group: Sequence[Cell], axis: Axis, edges: int, ticks: int) -> Array:
    """Places of the cells on an axis, logarithmic if its values are far apart, counted if they are words.

    What is written beside the axis are its own values.
    """
    values = [cell.settings[axis.field] for cell in group]
    if not axis.numeric:
        words = [axis.label(v) for v in axis.points]
        panel.set_xticks(range(len(words)), [in_words(word) for word in words], rotation=20)
        return np.array([words.index(v) for v in values], dtype=np.float64)
    numbers = np.array(axis.points, dtype=np.float64)
    positive = numbers[numbers > 0]
    if len(positive) and positive.max() > WIDE * positive.min():
        if len(positive) == len(numbers):
            panel.set_xscale("log")
        else:
            panel.set_xscale("symlog", linthresh=float(positive.min()))
    some = numbers[:: 1 + len(numbers) // ticks]
    written = [in_words(x, axis.field, edges).replace(" (", "\n(") for x in some.tolist()]
    panel.set_xticks(some.tolist(), labels=written, fontsize=7)
    panel.set_xticks([], minor=True)
    return np.array(values, dtype=np.float64)


def _finished(figure: Figure, panels: dict[str, Panel], axis: str, y: str) -> Figure:
    """Return a figure of panels with one legend."""
    every = [panel.get_legend_handles_labels() for panel in panels.values()]
    named = {label: handle for panel in every for handle, label in zip(*panel, strict=True)}
    for name, panel in panels.items():
        panel.set_title(name)
    figure.legend(named.values(), named.keys(), loc="upper center", ncols=6, frameon=False)
    figure.supylabel(y, fontsize=9, x=0.005)
    figure.supxlabel(axis, fontsize=9)
    return figure
