"""What a finished study leaves: a summary, a report and a recording beside its shards."""

from collections import Counter
from collections.abc import Iterator, Sequence
from pathlib import Path
from shlex import quote
from typing import TYPE_CHECKING, Any

import numpy as np
import tomli_w
from rich.console import Console
from rich.text import Text

from idbench.experiments.errors import ResultsError
from idbench.experiments.program import program
from idbench.experiments.reports.figures import rendered
from idbench.experiments.results.attempts import Attempts
from idbench.experiments.results.folder import ResultsFolder
from idbench.experiments.results.writing import finite, write_summary
from idbench.experiments.study.answer import (
    command,
    grouped,
    in_words,
    method,
    percent,
    settings_of,
    short,
    where,
    worst_runs,
)
from idbench.experiments.study.axis import FRICTION
from idbench.experiments.study.cluster import versions
from idbench.experiments.study.figures import (
    bars_figure,
    cost_figure,
    coverage_figure,
    error_figure,
    named_figure,
    typical_figure,
)
from idbench.experiments.study.ratios import (
    compares_models,
    interval,
    pair_of,
    ratios,
    ratios_table,
    study_answer,
    study_conclusion,
)
from idbench.experiments.study.statistics import BOUNDS, NAMED, Cell, cells, differences
from idbench.experiments.study.store import Store, arrays
from idbench.experiments.study.study import Study
from idbench.experiments.text import new_table, print_table
from idbench.experiments.text import percent as signed

if TYPE_CHECKING:
    from idbench.experiments.recording.study_recording import StudyRecording
    from idbench.experiments.results.page import Page


def report(study: Study, cells: Sequence[Cell], seconds: dict[str, float], folder: Path) -> str:
    """Return the page: question, answer, tables, figures, and how to make it again."""
    solved, axis = [cell for cell in cells if cell.runs], study.main_axis
    alike = families(study, solved)
    return rendered(
        "idbench.experiments.study",
        "report.html.j2",
        study=study,
        methods=len(study.methods),
        conclusion=study_conclusion(study, cells, _next(folder)),
        answer=study_answer(study, cells),
        typical=named_figure(alike, axis) if study.causes else typical_figure(alike, axis, study.edges) if solved else "",
        causes=study.causes,
        axes=[short(name) for name in cells[0].settings],
        overview=[_overview(cell) for cell in cells],
        families=[
            {"title": title, "error": error_figure(group, axis), "coverage": coverage_figure(group, axis)}
            for title, group in alike.items()
        ],
        bars=[(title, bars_figure(group)) for title, group in grouped(solved).items()] if len(study.estimators) > 1 else [],
        ratios=[[where(cell, cells), pair_of(row), interval(row), f"{row['runs']}"] for cell, row in ratios(solved)]
        if study.rows == "equal"
        else [],
        differences=[] if compares_models(study) else list(_differences(solved)),
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


def families(study: Study, cells: Sequence[Cell]) -> dict[str, list[Cell]]:
    """Return the cells that differ only in the main axis and the model, by what they have in common."""
    main, groups = study.main_axis.field, dict[str, list[Cell]]()
    for cell in cells:
        fixed = [f"{short(name)} {in_words(x)}" for name, x in cell.settings.items() if name != main]
        groups.setdefault(", ".join([*fixed, f"chain {cell.names[0]}", cell.names[1]]), []).append(cell)
    return groups


def _overview(cell: Cell) -> list[str]:
    settings = [in_words(x) for x in cell.settings.values()]
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
    largest = f"{percent(cell.rmse[worst])} {cell.parameters[worst]}"
    return [*head, percent(cell.typical), *least, largest, *shares, _often(cell)]


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


MOST_REASONS = 3  # Reasons of failures that are printed; the report has all


def write_results(page: "Page", store: Store, folder: ResultsFolder, recording: "StudyRecording | None") -> None:
    """Print the answer of a study, write summary.json into its folder, then report and recording, which may fail alone."""
    study, seconds = store.study, store.seconds()
    found = cells(arrays(store.table()), study.varied, study.parameters)
    answer = study_conclusion(study, found, _next(folder.out))
    answer.show(page)
    print_study(page, study, found)
    summary = summary_of(study, found, seconds) | {"conclusion": answer.summary()}
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


def _next(folder: Path) -> str:
    return f"{program()} view {quote(str(folder))}"


def print_study(page: Console, study: Study, found: Sequence[Cell]) -> None:
    """Print the table of a study, its answer, and why runs failed."""
    axes = [short(field) for field in study.varied if field != FRICTION] or [""]
    least = ["bound", "through reversals"] if study.bound else []
    often = ["simulations"] if any(cell.mean_simulations for cell in found) else []
    causes = ["named", "another named"] if study.causes else []
    columns = [*axes[1:], "identified by", "runs", "failed", "typical error", *least, "within 2 sigma", *often, *causes]
    grid = new_table(study.question, columns)
    for cell in found:
        settings = [in_words(x) for x in settings_of(cell).values()] or [""]
        numbers = f"{cell.runs}", f"{cell.failed or ''}"
        bounds = [percent(cell.typical_least(bound)) for bound in BOUNDS] if least else []
        errors = [percent(cell.typical), *bounds] if cell.runs else [""] * (1 + len(least))
        shares = [percent(share) if cell.runs else "" for share in cell.named_share] if causes else []
        judged = *errors, _held(cell), *([_often(cell)] if often else []), *shares
        grid.add_row(*settings, method(cell, found), *numbers, *judged)
    grid.columns[0].header = axes[0]
    print_table(page, grid, len(axes) + 1)
    if study.rows == "equal" and (pairs := list(ratios(found))):
        print_table(page, ratios_table(pairs), 3)
    page.print(Text(study_answer(study, found)))
    for reason in _reasons(found)[:MOST_REASONS]:
        page.print(Text(f"failed: {reason}"), soft_wrap=True)


def _held(cell: Cell) -> str:
    """Coverage of two sigma over the parameters of the cell."""
    held = cell.coverage(cell.sigma)
    return f"{100 * np.nanmean(held):.0f} %" if np.isfinite(held).any() else ""


def _often(cell: Cell) -> str:
    """How often the estimator simulated a run; empty if it does not."""
    return f"{cell.mean_simulations:.3g}" if cell.mean_simulations else ""


def _reasons(found: Sequence[Cell]) -> list[str]:
    """Reasons of failed runs, the most frequent first."""
    counts: Counter[str] = Counter()
    for cell in found:
        counts.update({reason: len(runs) for reason, runs in cell.failures.items()})
    return [f"{count} times: {reason}" for reason, count in counts.most_common()]


def summary_of(study: Study, found: Sequence[Cell], seconds: dict[str, float]) -> dict[str, Any]:
    """Summary of a study."""
    return {
        "experiment": "study",
        "versions": versions(),
        "seed": study.seed,
        "study": study.content,
        "scenario": study.scenario,
        "answer": study_answer(study, found),
        "parameters": list(study.parameters),
        "cells": [_cell(cell) for cell in found],
        **({"ratios": [row for _, row in ratios(found)]} if study.rows == "equal" else {}),
        "seconds": {**seconds, "runs": study.size},
    }


def _cell(cell: Cell) -> dict[str, Any]:
    chain, estimator, model = cell.names
    summary: dict[str, Any] = {"settings": dict(cell.settings), "chain": chain, "estimator": estimator, "model": model}
    summary |= {"runs": cell.runs, "simulations": cell.mean_simulations}
    if cell.named is not None:
        summary |= dict(zip(NAMED, map(finite, cell.named_share), strict=True))
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
        summary |= {name: [finite(x) for x in values] for name, values in numbers.items()}
    return summary
