"""The command that makes the table of a benchmark, a row a set."""

from collections.abc import Mapping
from pathlib import Path

from rich.text import Text

from idbench.experiments.benchmark.definition import SHIPPED, read_definition, shipped
from idbench.experiments.benchmark.job import RowOrReason, rows_of, sets_of
from idbench.experiments.benchmark.tables import print_rows, report
from idbench.experiments.cli.options.jobs import Benchmark
from idbench.experiments.results.attempts import Attempts
from idbench.experiments.results.folder import ResultsFolder
from idbench.experiments.results.page import Page, new_page, shown, stages_of
from idbench.experiments.results.writing import write_summary


def benchmark(options: Benchmark) -> None:
    """Make the rows of sets that are missing, and the table of all; or list the sets that ship."""
    page = new_page(machine=options.json)
    if not options.sets:
        _list(page)
        return
    sets, out = sets_of(options), options.out or Path("runs") / "benchmark"
    whole = ResultsFolder(out, "benchmark", "idbench benchmark", options.force)
    rows = dict[str, RowOrReason]()
    with shown(page), whole.held():
        try:
            with stages_of("benchmark") as told:
                for name, made in rows_of(options, out, told, force=options.force):
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


def _show(page: Page, rows: Mapping[str, RowOrReason]) -> None:
    there = [row for row in rows.values() if not isinstance(row, str)]
    page.found |= {"experiment": "benchmark", "rows": there}
    page.found["failures"] = {name: why for name, why in rows.items() if isinstance(why, str)}
    if there:
        print_rows(page, there)
    page.show()
