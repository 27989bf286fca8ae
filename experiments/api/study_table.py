"""A study as a Python session sees it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from io import StringIO
from typing import Any

import numpy as np
import numpy.typing as npt
from rich.console import Console

from idbench.experiments.study.statistics import Cell, cells
from idbench.experiments.study.store import Store, arrays
from idbench.experiments.study.study import Study
from idbench.experiments.study.study_results import print_study, summary_of
from idbench.experiments.text import printed

WIDTH = 160  # Characters of a line


@dataclass(frozen=True, eq=False)
class StudyTable:
    """The runs of a study, and what they say of every combination."""

    study: Study
    """The study."""
    rows: Mapping[str, npt.NDArray[Any]]
    """Every run and identification: columns by name, shape (rows,)."""
    cells: Sequence[Cell]
    """Errors and coverage of every combination and model."""
    seconds: Mapping[str, float]
    """Time of simulating and identifying [s]."""

    @classmethod
    def of(cls, store: Store) -> "StudyTable":
        """Return the table of the runs in a folder."""
        rows = arrays(store.table())
        return cls(store.study, rows, cells(rows, store.study.varied, store.study.parameters), store.seconds())

    def summary(self) -> dict[str, Any]:
        """Return what `idbench study` writes into summary.json."""
        return summary_of(self.study, self.cells, dict(self.seconds))

    def typical_errors(self) -> dict[tuple[Any, ...], float]:
        """Return the typical relative error of each combination, by its settings, chain, estimator and model."""
        return {(*cell.settings.values(), *cell.names): float(cell.typical) if cell.runs else np.nan for cell in self.cells}

    def __repr__(self) -> str:
        return printed(lambda console: print_study(console, self.study, self.cells))

    def _repr_html_(self) -> str:
        console = Console(file=StringIO(), width=WIDTH, record=True)
        print_study(console, self.study, self.cells)
        return console.export_html(inline_styles=True, code_format="<pre>{code}</pre>")
