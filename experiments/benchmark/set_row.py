"""One set of a benchmark, as a worker makes it: read, fitted, judged, saved."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from idbench.experiments.benchmark.definition import Definition, read_definition
from idbench.experiments.benchmark.files import files_of, kept_row, made_of_files, require_files
from idbench.experiments.benchmark.row import Made, identified_row
from idbench.experiments.benchmark.servo_row import servo_row
from idbench.experiments.errors import ExperimentError, ResultsError, reason
from idbench.experiments.results.folder import ResultsFolder
from idbench.experiments.results.writing import write_summary

ROWS: Mapping[str, Callable[[Path, Definition, Path], Made]] = {"identify": identified_row, "servo": servo_row}
"""What makes the row of a set, by the name of its request: of folder, definition and results."""


def set_row(folder: Path, out: Path, force: bool) -> dict[str, Any]:
    """Return the row of a set: that of earlier results if it is of the same definition, files and version.

    Raises
    ------
    ExperimentError, IdentificationError, BenchError
        If there is none.
    """
    definition = read_definition(folder)
    require_files(folder, definition)
    if out == folder:
        raise ExperimentError(f"the results of {folder} would go into the set itself: choose another --out")
    made_of = made_of_files(folder, definition, out)
    if not force and (kept := kept_row(out, made_of)) is not None:
        return kept
    results = ResultsFolder(out, "benchmark-set", f"idbench benchmark {folder.name}", force, files_of(folder, definition))
    with results.held():
        made, write = ROWS[definition.job](folder, definition, out)
        row = {"set": folder.name, **made, "made_of": made_of}
        try:
            with results.complete() as hidden:
                write(hidden)
                write_summary(hidden / "summary.json", row)
        except (ResultsError, OSError) as error:  # a full disk: the row is printed all the same
            row["unsaved"] = reason(error)
    return row
