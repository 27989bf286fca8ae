"""Tables of the pages, from the results of the studies that ship.

    uv run python docs/build/tables.py [FOLDER]

FOLDER has a folder of results for each study, as `idbench study NAME --out FOLDER/NAME` leaves them; without it the results
that were kept in docs/results are written into the pages anew. A test holds that pages and results agree.
"""

import json
import re
import sys
from collections.abc import Callable, Iterator, Sequence
from math import log2
from pathlib import Path
from typing import Any

from answers_tables import ANSWERS_TABLES
from benchmark_tables import BENCHMARK_TABLES
from conclusion_sentences import sentences
from conclusion_tables import CONCLUSION_TABLES, keep_conclusion
from estimator_tables import compared, compared_in_birdys_shape
from excitation_tables import criteria
from fault_tables import cogging
from results import DOCS, RESULTS, Cell, Column, by_settings, cells, coverage, keep, table, typical
from reversal_tables import reversals
from simulated_tables import SIMULATED_TABLES

sys.path.insert(0, str(DOCS.parent))
MARK = re.compile(r"<!-- table: ([\w-]+) -->\n.*?<!-- end -->", re.DOTALL)
PAGES = sorted(path.name for path in DOCS.glob("*.md") if MARK.search(path.read_text()))

I, P = "idbench", "paper"
FOUR: Sequence[Column] = ((I, "explicit"), (I, "power"), (P, "explicit"), (P, "power"))
BOUNDS = ("bound_percent", "bound_through_reversals_percent")
TWO: Sequence[Column] = ((I, "explicit"), (I, "power"))


def filled(text: str) -> str:
    """Return a page with its tables as the results have them."""
    return MARK.sub(lambda found: f"<!-- table: {found[1]} -->\n{''.join(TABLES[found[1]]())}<!-- end -->", text)


def _usual(study: str, name: str, label: Callable[[dict[str, Any]], str], columns: Sequence[Column]) -> Iterator[str]:
    """Yield typical errors of chains and models, and coverages in chain idbench, a row a setting."""
    several = len({chain for chain, _ in columns}) > 1
    names = [f"{model}, {chain}" if several else model for chain, model in columns]
    own = [column for column in columns if column[0] == I]
    head = [name, *names, f"coverage: {names[0]}", *names[1 : len(own)]]
    rows = (
        [label(settings), *(typical(group[c]) for c in columns), *(coverage(group[c]) for c in own)]
        for settings, group in by_settings(study)
    )
    yield from table(head, rows)


def _lines(settings: dict[str, Any]) -> str:
    lines = settings["encoder.lines"]
    return f"{lines:g} ({log2(4 * lines):g} bits)"


def _one(key: str, scale: float = 1.0) -> Callable[[dict[str, Any]], str]:
    return lambda settings: f"{float(f'{scale * settings[key]:.3g}'):g}"


def _sigma() -> Iterator[str]:
    def rows() -> Iterator[Sequence[str]]:
        first = cells("sigma")[0]["settings"]  # the other noise, joints exchanged, gives the same; explicit and implicit, too
        for cell in cells("sigma"):
            if cell["settings"] == first and cell["model"] != "implicit":
                shares = (coverage(cell, key, 1) for key in ("coverage", "paper_coverage"))
                yield [cell["estimator"], cell["model"], *shares]

    yield from table(["estimator", "model", "calibrated", "the paper's"], rows())


def _bound(study: str, name: str, label: Callable[[dict[str, Any]], str]) -> Callable[[], Iterator[str]]:
    methods = ("WLS", "GLS", "ML")

    def rows() -> Iterator[Sequence[str]]:
        groups: dict[str, dict[str, Cell]] = {}
        for cell in cells(study):
            if cell["model"] == "explicit":
                groups.setdefault(json.dumps(cell["settings"]), {})[cell["estimator"]] = cell
        for settings, group in groups.items():
            bounds = (typical({"rmse_percent": group["WLS"][key]}) for key in BOUNDS)
            errors, shares = (typical(group[m]) for m in methods), (coverage(group[m]) for m in methods)
            yield [label(json.loads(settings)), *errors, *bounds, *shares]

    return lambda: table([name, *methods, "bound", "through reversals", "coverage: WLS", "GLS", "ML"], rows())


def _causes(form: str) -> Callable[[], Iterator[str]]:
    """Return what makes the table of Table 2's causes, of one model."""

    def made() -> Iterator[str]:
        from idbench.experiments.text import percent

        found = json.loads((RESULTS / "table2.json").read_text())
        causes = found["attribution_percent"].items()
        rows = ([cause, *(percent(error) for error in errors[form])] for cause, errors in causes)
        yield from table(["", *found["parameters"]], rows)

    return made


def _zoo() -> Iterator[str]:
    """Yield the table of robots of other people, a row each."""
    head = ["", "file", "joints", "parameters", "within 2 sigma", "written files off by", "seconds"]

    def rows() -> Iterator[Sequence[str]]:
        for one in json.loads((RESULTS / "zoo.json").read_text()):
            shares = f"{100 * one['inside']:.0f} %", f"{100 * one['files']:.2f} %"
            yield [
                one["what"],
                f"`{one['file']}`",
                f"{one['joints']}",
                f"{one['parameters']}",
                *shares,
                f"{one['seconds']:.1f}",
            ]

    yield from table(head, rows())


TABLES: dict[str, Callable[[], Iterator[str]]] = {
    "zoo": _zoo,
    "encoder": lambda: _usual("encoder", "lines (counts)", _lines, FOUR),
    "torque-noise": lambda: _usual("torque-noise", "rms [N m]", _one("torque.noise"), FOUR),
    "ripple": lambda: _usual("ripple", "cogging", _one("ripple.cogging"), TWO),
    "delay": lambda: _usual("delay", "delay [ms]", _one("timing.delay", 1e3), FOUR),
    "sigma": _sigma,
    "table2-explicit": _causes("explicit"),
    "bound-encoder": _bound("bound-encoder", "lines (counts)", _lines),
    "reversals": reversals,
    "excitation-criteria": criteria,
    "estimators-idbench": compared("idbench"),
    "estimators-unfiltered": compared("unfiltered"),
    "estimators-puma560": compared_in_birdys_shape,
    "ripple-named": cogging,
    **BENCHMARK_TABLES,
    "sentences": sentences,
    **CONCLUSION_TABLES,
    **SIMULATED_TABLES,
    **ANSWERS_TABLES,
}

if __name__ == "__main__":
    RESULTS.mkdir(exist_ok=True)
    for place in sys.argv[1:]:
        keep(Path(place))
        keep_conclusion(Path(place))
    for page in PAGES:
        (DOCS / page).write_text(filled((DOCS / page).read_text()))
