"""What a finished study leaves: a summary, a report and a recording beside its shards."""

from collections import Counter
from collections.abc import Sequence
from math import isfinite
from typing import TYPE_CHECKING, Any

import numpy as np
from rich.console import Console
from rich.text import Text

from idbench.experiments.errors import ResultsError
from idbench.experiments.results.attempts import Attempts
from idbench.experiments.results.folder import ResultsFolder
from idbench.experiments.results.writing import write_summary
from idbench.experiments.study.answer import answer, method, percent, settings_of, short, value
from idbench.experiments.study.axis import FRICTION
from idbench.experiments.study.cluster import versions
from idbench.experiments.study.statistics import BOUNDS, Cell, cells
from idbench.experiments.study.store import Store, arrays
from idbench.experiments.study.study import Study
from idbench.experiments.study.study_report import report
from idbench.experiments.text import new_table, print_table

MOST_REASONS = 3
"""Reasons of failures that are printed; the report has all."""

if TYPE_CHECKING:
    from idbench.experiments.recording.study_recording import StudyRecording
    from idbench.experiments.results.page import Page


def write_results(page: "Page", store: Store, folder: ResultsFolder, recording: "StudyRecording | None") -> None:
    """Print the answer of a study, write summary.json into its folder, then report and recording, which may fail alone."""
    study, seconds = store.study, store.seconds()
    found = cells(arrays(store.table()), study.varied, study.parameters)
    print_study(page, study, found)
    summary = summary_of(study, found, seconds)
    page.found |= summary | {"folder": str(folder.out)}
    page.show()
    with folder.complete() as hidden:
        write_summary(hidden / "summary.json", summary)
    page.end()
    with Attempts(f"the answer is printed, and with all runs in {folder.out}", folder) as attempts:
        attempts.file("report.html", lambda: report(study, found, seconds, folder.out))
        if recording:
            attempts.recording(lambda: recording.finish(found))
        page.print(Text(f"\nwritten to {store.folder}: open {store.folder / 'report.html'}"), soft_wrap=True)
    if not any(cell.runs for cell in found):
        raise ResultsError(f"no run of study {study.name} gave an estimate: {_reasons(found)[0]}")


def print_study(page: Console, study: Study, found: Sequence[Cell]) -> None:
    """Print the table of a study, its answer, and why runs failed."""
    axes = [short(field) for field in study.varied if field != FRICTION] or [""]
    least = ["bound", "through reversals"] if study.bound else []
    often = ["simulations"] if any(cell.mean_simulations for cell in found) else []
    columns = [*axes[1:], "identified by", "runs", "failed", "typical error", *least, "within 2 sigma", *often]
    grid = new_table(study.question, columns)
    for cell in found:
        settings = [value(x) for x in settings_of(cell).values()] or [""]
        numbers = f"{cell.runs}", f"{cell.failed or ''}"
        bounds = [percent(cell.typical_least(bound)) for bound in BOUNDS] if least else []
        errors = [percent(cell.typical), *bounds] if cell.runs else [""] * (1 + len(least))
        judged = *errors, _held(cell), *_often(cell, often)
        grid.add_row(*settings, method(cell, found), *numbers, *judged)
    grid.columns[0].header = axes[0]
    print_table(page, grid, len(axes) + 1)
    page.print(Text(answer(found, study.edges)))
    for reason in _reasons(found)[:MOST_REASONS]:
        page.print(Text(f"failed: {reason}"), soft_wrap=True)


def _held(cell: Cell) -> str:
    """Return how many truths lie within two sigma, of those parameters that the cell has."""
    held = cell.coverage(cell.sigma)
    return f"{100 * np.nanmean(held):.0f} %" if np.isfinite(held).any() else ""


def _often(cell: Cell, shown: Sequence[str]) -> list[str]:
    return [f"{cell.mean_simulations:.3g}" if cell.mean_simulations else ""] if shown else []


def _reasons(found: Sequence[Cell]) -> list[str]:
    """Return why runs failed, the most frequent reason first."""
    counts: Counter[str] = Counter()
    for cell in found:
        counts.update({reason: len(runs) for reason, runs in cell.failures.items()})
    return [f"{count} times: {reason}" for reason, count in counts.most_common()]


def summary_of(study: Study, found: Sequence[Cell], seconds: dict[str, float]) -> dict[str, Any]:
    """Return what a summary.json says of a study."""
    return {
        "experiment": "study",
        "versions": versions(),
        "seed": study.seed,
        "study": study.content,
        "scenario": study.scenario,
        "answer": answer(found, study.edges),
        "parameters": list(study.parameters),
        "cells": [_cell(cell) for cell in found],
        "seconds": {**seconds, "runs": study.size},
    }


def _cell(cell: Cell) -> dict[str, Any]:
    chain, estimator, model = cell.names
    summary: dict[str, Any] = {"settings": dict(cell.settings), "chain": chain, "estimator": estimator, "model": model}
    summary |= {"runs": cell.runs, "simulations": cell.mean_simulations}
    summary |= {"failures": {reason: len(runs) for reason, runs in cell.failures.items()}}
    if cell.runs:
        numbers = {
            "truth": cell.truth.mean(axis=0),
            "bias_percent": 100 * cell.bias,
            "bias_margin_percent": 100 * cell.bias_margin,
            "deviation_percent": 100 * cell.deviation,
            "rmse_percent": 100 * cell.rmse,
            "coverage": cell.coverage(cell.sigma),
            "coverage_low": cell.coverage_interval(cell.sigma)[:, 0],
            "coverage_high": cell.coverage_interval(cell.sigma)[:, 1],
            "paper_coverage": cell.coverage(cell.paper_sigma),
            **{f"{bound[1:]}_percent": 100 * cell.least(bound) for bound in BOUNDS},
        }
        summary |= {name: [float(x) if isfinite(x) else None for x in values] for name, values in numbers.items()}
    return summary
