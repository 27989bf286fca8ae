"""The job `benchmark`: a request becomes a row for each set, here or on workers."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from idbench.experiments.benchmark.definition import FILE, Definition, read_definition
from idbench.experiments.benchmark.files import files_of, kept_row, made_of_files, require_files
from idbench.experiments.benchmark.row import Made, identified_row
from idbench.experiments.benchmark.servo_row import servo_row
from idbench.experiments.errors import ExperimentError, ResultsError, is_told, reason
from idbench.experiments.errors import report as report_fault
from idbench.experiments.requests.jobs import BenchmarkRequest
from idbench.experiments.results.folder import ResultsFolder
from idbench.experiments.results.writing import write_summary
from idbench.experiments.study.cluster import require_versions, versions

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


RowOrReason = dict[str, Any] | str
"""A row, or why there is none."""

Told = Callable[[str, float], None]
"""Hears which set is made, and which share is done."""

Run = Callable[[Mapping[str, Path], Path, Told], Iterator[tuple[str, RowOrReason]]]
"""Makes rows of sets into a folder, one after the other as they are done."""


def rows_of(asked: BenchmarkRequest, out: Path, told: Told, *, force: bool = False) -> Iterator[tuple[str, RowOrReason]]:
    """Yield the row of each set, or why there is none, by its name; rows that a folder has already are not made again.

    Raises
    ------
    ExperimentError
        If a folder is no set, or two have one name; before any row is made.
    """
    sets = sets_of(asked)
    with _workers(asked, force) as run:
        yield from run(sets, out.resolve(), told)


def sets_of(asked: BenchmarkRequest) -> dict[str, Path]:
    """Return the folders of the sets by their names; raise ExperimentError if two have one, or one is no set."""
    sets = _by_name(asked.sets)
    for folder in sets.values():
        read_definition(folder)
    return sets


def _by_name(folders: Sequence[Path]) -> dict[str, Path]:
    """Return the folders by their names; raise ExperimentError if two have one."""
    found = dict[str, Path]()
    for folder in folders:
        place = (folder.parent if folder.name == FILE else folder).resolve()
        if place.name in found:
            raise ExperimentError(
                f"{found[place.name]} and {folder} have one name, and would have one folder of results: rename one"
            )
        found[place.name] = place
    return found


@contextmanager
def _workers(asked: BenchmarkRequest, force: bool) -> Iterator[Run]:
    """Give what makes rows: this process, or workers."""
    if asked.workers is not None and asked.workers < 1:
        raise ExperimentError(f"--workers {asked.workers} must be at least 1")
    if asked.workers and asked.scheduler:
        raise ExperimentError("--workers, --scheduler name several places to run: give one")
    if not asked.workers and not asked.scheduler:
        yield lambda sets, out, told: _here(sets, out, force, told)
        return
    from idbench.experiments.study.cluster import connected

    with connected(asked.scheduler, asked.workers or 1, "give the same command again") as client:
        from distributed import KilledWorker, as_completed

        def run(sets: Mapping[str, Path], out: Path, told: Told) -> Iterator[tuple[str, RowOrReason]]:
            waiting = {
                client.submit(attempted, folder, out / name, force, versions(), pure=False): name
                for name, folder in sets.items()
            }
            for k, future in enumerate(as_completed(waiting)):
                told(f"{k + 1} of {len(sets)} sets", (k + 1) / len(sets))
                try:
                    made = future.result()
                except KilledWorker as error:
                    made = f"the worker ended with it: {' '.join(str(error).split())[:200]}"
                yield waiting[future], made

        yield run


def _here(sets: Mapping[str, Path], out: Path, force: bool, told: Told) -> Iterator[tuple[str, RowOrReason]]:
    for k, (name, folder) in enumerate(sets.items()):
        told(f"{name}, {k + 1} of {len(sets)}", k / len(sets))
        yield name, attempted(folder, out / name, force, versions())


def attempted(folder: Path, out: Path, force: bool, theirs: dict[str, str]) -> RowOrReason:
    """Return the row of a set, or why there is none; on a worker, too."""
    require_versions(theirs, "the process that makes the benchmark")
    try:
        return set_row(folder, out, force)
    except Exception as error:  # a fault of one set takes no other away
        return reason(error) if is_told(error) else f"{reason(error)}; its traceback is in {report_fault(error)}"
