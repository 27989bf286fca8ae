"""The report of a study: one HTML file that needs no other."""

from collections.abc import Iterator, Sequence
from pathlib import Path
from shlex import quote
from typing import Any

import numpy as np
import tomli_w

from idbench.experiments.reports.html import rendered
from idbench.experiments.study.answer import answer, grouped, headline, method, percent, short, value, where
from idbench.experiments.study.axis import Axis
from idbench.experiments.study.cluster import versions
from idbench.experiments.study.comparison import differences
from idbench.experiments.study.figures import bars_figure, cost_figure, coverage_figure, error_figure, typical_figure
from idbench.experiments.study.statistics import BOUNDS, Cell
from idbench.experiments.study.study import Study
from idbench.experiments.text import percent as signed

WORST = 10
"""Runs that are listed as the worst."""


def report(study: Study, cells: Sequence[Cell], seconds: dict[str, float], folder: Path) -> str:
    """Return the page: question, answer, tables, figures, and how to make it again."""
    solved = [cell for cell in cells if cell.runs]
    return rendered(
        "idbench.experiments.study",
        "report.html.j2",
        study=study,
        methods=len(study.methods),
        headline=headline(solved, study.edges) if solved else "",
        answer=answer(cells, study.edges),
        typical=typical_figure(dict(families(study, solved)), main_axis(study), study.edges) if solved else "",
        axes=[short(name) for name in cells[0].settings],
        overview=[_overview(cell) for cell in cells],
        families=[_family(title, group, main_axis(study)) for title, group in families(study, solved)],
        bars=[(title, bars_figure(group)) for title, group in _comparisons(study, solved)],
        differences=list(_differences(solved)),
        details=[row for cell in solved for row in _details(cell, where(cell, cells))],
        failed=[
            (where(c, cells), len(runs), f"{reason} (run {runs[0]})") for c in cells for reason, runs in c.failures.items()
        ],
        worst=[
            (where(c, cells), name, signed(100 * e), command(study, folder, c, run)) for c, name, e, run in worst_runs(solved)
        ],
        cost=cost_figure(seconds, study.size),
        versions=versions(),
        toml=tomli_w.dumps(study.content),
    )


def main_axis(study: Study) -> Axis:
    """Return the axis with the most values: figures are drawn against it."""
    return max(study.every_axis, key=lambda axis: len(axis.points))


def families(study: Study, cells: Sequence[Cell]) -> Iterator[tuple[str, list[Cell]]]:
    """Yield the cells that differ only in the main axis and the model, with what they have in common."""
    main, groups = main_axis(study).field, dict[str, list[Cell]]()
    for cell in cells:
        fixed = [f"{short(name)} {value(x)}" for name, x in cell.settings.items() if name != main]
        groups.setdefault(", ".join([*fixed, f"chain {cell.names[0]}", cell.names[1]]), []).append(cell)
    yield from groups.items()


def _comparisons(study: Study, cells: Sequence[Cell]) -> Iterator[tuple[str, list[Cell]]]:
    """Yield the cells of each combination of settings, of studies that compare estimators."""
    if len(study.estimators) > 1:
        yield from grouped(cells).items()


def worst_runs(cells: Sequence[Cell]) -> list[tuple[Cell, str, float, int]]:
    """Return the identifications with the largest relative errors: cell, parameter, error, run.

    The worst run of each combination and model comes first, so that not all are of one kind; each run is there once.
    """
    firsts, others = list[tuple[Cell, str, float, int]](), list[tuple[Cell, str, float, int]]()
    for cell in cells:
        p = np.nan_to_num(np.abs(cell.error)).argmax(axis=1)
        own = [(cell, cell.parameters[j], float(cell.error[i, j]), int(cell.run[i])) for i, j in enumerate(p)]
        own.sort(key=_by_size)
        firsts += own[:1]
        others += own[1:]
    worst: dict[int, tuple[Cell, str, float, int]] = {}
    for entry in [*sorted(firsts, key=_by_size), *sorted(others, key=_by_size)]:
        worst.setdefault(entry[3], entry)
    return list(worst.values())[:WORST]


def _by_size(entry: tuple[Cell, str, float, int]) -> float:
    return -abs(entry[2])


def command(study: Study, folder: Path, cell: Cell, run: int) -> str:
    """Return what makes a run again, identified as in a cell."""
    number = next(i for i, found in enumerate(study.methods) if found.names == cell.names[:2] and found.fits(cell.settings))
    chosen = f" --method {number}" if number else ""
    return f"uv run idbench run --from {quote(str(folder))} --index {run}{chosen}"


def _family(title: str, cells: Sequence[Cell], axis: Axis) -> dict[str, Any]:
    figures = {"error": error_figure(cells, axis), "coverage": coverage_figure(cells, axis)}
    return {"title": title, **figures}


def _overview(cell: Cell) -> list[str]:
    settings = [value(x) for x in cell.settings.values()]
    head = [*settings, *cell.names, f"{cell.runs}", f"{cell.failed or ''}"]
    if not cell.runs:
        return [*head, *[""] * 7]
    worst = int(np.nan_to_num(cell.rmse).argmax())
    shares = []
    for sigma in (cell.sigma, cell.paper_sigma):
        share = 100 * cell.coverage(sigma)
        share = share[np.isfinite(share)]  # of what was identified
        shares.append(f"{share.mean():.0f} % ({share.min():.0f} to {share.max():.0f})" if share.size else "")
    least = [percent(x) if np.isfinite(x := cell.typical_least(bound)) else "" for bound in BOUNDS]
    often = f"{cell.mean_simulations:.3g}" if cell.mean_simulations else ""
    return [*head, percent(cell.typical), *least, f"{percent(cell.rmse[worst])} {cell.parameters[worst]}", *shares, often]


def _details(cell: Cell, title: str) -> Iterator[list[str]]:
    interval = cell.coverage_interval(cell.sigma)
    corrected = cell.coverage(cell.sigma)
    paper = cell.coverage(cell.paper_sigma)
    for p, name in enumerate(cell.parameters):
        if not np.isfinite(cell.truth[:, p]).any():  # of a law of friction that this method does not identify
            continue
        bias = f"{signed(100 * cell.bias[p])} ± {100 * cell.bias_margin[p]:.2g}"
        share = f"{100 * corrected[p]:.1f} ({100 * interval[p, 0]:.0f} to {100 * interval[p, 1]:.0f})"
        spread = f"{100 * cell.deviation[p]:.3g}", f"{100 * cell.rmse[p]:.3g}"
        yield [title, name, bias, *spread, share, f"{100 * paper[p]:.1f}"]


def _differences(cells: Sequence[Cell]) -> Iterator[list[str]]:
    for title, group in grouped(cells).items():
        for d in differences(group):
            yield [title, method(d.better, cells), method(d.worse, cells), f"{d.ratio:.3g}", f"{d.p:.1g}", f"{d.runs}"]
