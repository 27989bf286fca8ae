"""The command that makes the table of a benchmark, a row a set."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from rich.text import Text

from idbench.experiments.benchmark.definition import FILE, SHIPPED, read_definition, shipped
from idbench.experiments.benchmark.set_row import set_row
from idbench.experiments.benchmark.tables import print_rows, report
from idbench.experiments.cli.options.jobs import Benchmark
from idbench.experiments.cli.page import Page, Told, new_page, shown, stages_of
from idbench.experiments.errors import ExperimentError, is_told, reason
from idbench.experiments.errors import report as report_fault
from idbench.experiments.results.attempts import Attempts
from idbench.experiments.results.folder import ResultsFolder
from idbench.experiments.results.writing import write_summary
from idbench.experiments.study.cluster import require_versions, versions

Made = dict[str, Any] | str
"""A row, or why there is none."""


def benchmark(options: Benchmark) -> None:
    """Make the rows of sets that are missing, and the table of all; or list the sets that ship."""
    page = new_page(machine=options.json)
    if not options.sets:
        _list(page)
        return
    sets = _sets(options.sets)
    out = options.out or Path("runs") / "benchmark"
    for folder in sets.values():
        read_definition(folder)
    whole = ResultsFolder(out, "benchmark", "idbench benchmark", options.force)
    rows = dict[str, Made]()
    with shown(page), whole.held():
        try:
            with stages_of("benchmark") as told, _workers(options) as run:
                for name, made in run(sets, out.resolve(), told):
                    rows[name] = made
        finally:
            _show(page, {name: rows[name] for name in sets if name in rows})
        with whole.complete() as hidden:
            write_summary(hidden / "summary.json", page.found)
        there = "the table is printed, and in" if page.found["rows"] else "what failed is in"
        with Attempts(f"{there} {out}", whole) as attempts:
            for name, made in rows.items():
                if isinstance(made, str):
                    attempts.failed(name, made)
            attempts.file("report.html", lambda: report(page.found["rows"], page.found["failures"]))
            page.print(Text(f"written to {out}: open {out / 'report.html'}"), soft_wrap=True)


def _list(page: Page) -> None:
    for name in shipped():
        known = read_definition(SHIPPED / name)
        page.out(f"{name:12}  {known.title}; {known.source}; {known.license}")
        page.found[name] = {"title": known.title, "source": known.source, "license": known.license}
    page.close()


def _sets(folders: Sequence[Path]) -> dict[str, Path]:
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


def _show(page: Page, rows: Mapping[str, Made]) -> None:
    there = [row for row in rows.values() if not isinstance(row, str)]
    page.found |= {"experiment": "benchmark", "rows": there}
    page.found["failures"] = {name: why for name, why in rows.items() if isinstance(why, str)}
    if there:
        print_rows(page, there)
    page.show()


Run = Callable[[Mapping[str, Path], Path, Told], Iterator[tuple[str, Made]]]


@contextmanager
def _workers(options: Benchmark) -> Iterator[Run]:
    """Give what makes rows: this process, or workers."""
    if options.workers is not None and options.workers < 1:
        raise ExperimentError(f"--workers {options.workers} must be at least 1")
    if options.workers and options.scheduler:
        raise ExperimentError("--workers, --scheduler name several places to run: give one")
    if not options.workers and not options.scheduler:
        yield lambda sets, out, told: _here(sets, out, options.force, told)
        return
    from idbench.experiments.study.cluster import connected

    with connected(options.scheduler, options.workers or 1, "give the same command again") as client:
        from distributed import KilledWorker, as_completed

        def run(sets: Mapping[str, Path], out: Path, told: Told) -> Iterator[tuple[str, Made]]:
            waiting = {
                client.submit(attempted, folder, out / name, options.force, versions(), pure=False): name
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


def _here(sets: Mapping[str, Path], out: Path, force: bool, told: Told) -> Iterator[tuple[str, Made]]:
    for k, (name, folder) in enumerate(sets.items()):
        told(f"{name}, {k + 1} of {len(sets)}", k / len(sets))
        yield name, attempted(folder, out / name, force, versions())


def attempted(folder: Path, out: Path, force: bool, theirs: dict[str, str]) -> Made:
    """Return the row of a set, or why there is none; on a worker, too."""
    require_versions(theirs, "the process that makes the benchmark")
    try:
        return set_row(folder, out, force)
    except Exception as error:  # a fault of one set takes no other away
        return reason(error) if is_told(error) else f"{reason(error)}; its traceback is in {report_fault(error)}"
