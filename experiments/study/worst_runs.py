"""The worst runs of a study, and the commands that make them again."""

from collections.abc import Sequence
from pathlib import Path
from shlex import quote

import numpy as np

from idbench.experiments.program import program
from idbench.experiments.study.statistics import Cell
from idbench.experiments.study.study import Study

WORST = 10  # Runs that are listed


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
    """Command that makes a run again, identified as in a cell."""
    number = next(i for i, found in enumerate(study.methods) if found.fits(*cell.names[:2], cell.settings))
    chosen = f" --method {number}" if number else ""
    return f"{program()} run --from {quote(str(folder))} --index {run}{chosen}"
