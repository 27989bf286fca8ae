"""The tables of the benchmark of public sets, from what tests/benchmarks/public_sets.py leaves.

    uv run python docs/build/benchmark_tables.py runs/benchmark

keeps in docs/results what the page needs, and writes the page anew.
"""

import json
import sys
from collections.abc import Iterator
from pathlib import Path
from statistics import median
from typing import Any

from results import RESULTS, short, table

sys.path.insert(0, str(Path(__file__).parents[2] / "tests" / "benchmarks"))

OWN = "idbench"
TOOLS = {
    OWN: "idbench",
    "pinocchio": "least squares",
    "flobaroid": "FloBaRoID",
    "figaroh": "FIGAROH",
    "figaroh-tuned": "FIGAROH, tuned",
}
"""What tools are called in the tables, by their names in files."""

Row = dict[str, Any]


def keep_benchmark(folder: Path) -> None:
    """Keep of the rows of a benchmark what the page needs."""
    rows = [_kept(json.loads(path.read_text())) for path in sorted(folder.glob("*/summary.json"))]
    text = "[\n" + ",\n".join(json.dumps(row) for row in rows) + "\n]\n"
    (RESULTS / "benchmark.json").write_text(text)


def _kept(row: Row) -> Row:
    from set_tables import free_run, share, worst_R2

    tools = {OWN: (row["logs"], row["seconds"])}
    tools |= {tool: (found["logs"], found["seconds"]) for tool, found in row["tools"].items() if "logs" in found}
    free = free_run(row)
    return {
        "title": row["title"],
        "joints": len(row["joints"]),
        "parameters": row["parameters"],
        "verdict": row["verdict"],
        "R2": short(worst_R2(row).tolist()),
        "agree": row["repeats"].get("compared", 0) and short(row["repeats"]["inside"] / row["repeats"]["compared"]),
        "contained": _contained(row),
        "free_run": short(free) if free == free else None,  # noqa: PLR0124  # NaN is not itself
        "seconds": {tool: short(seconds) for tool, (_, seconds) in tools.items()},
        "percent": {tool: short(share(row, logs).tolist()) for tool, (logs, _) in tools.items()},
    }


def _contained(row: Row) -> float | None:
    """Return the share of the held-out torques that lie in their intervals."""
    inside = [x for log in row["logs"] for x in log.get("within_interval", ()) if x is not None]
    return short(sum(inside) / len(inside)) if inside else None


def _rows() -> list[Row]:
    found: list[Row] = json.loads((RESULTS / "benchmark.json").read_text())
    return found


def _with_torques() -> list[Row]:
    return [row for row in _rows() if row["percent"][OWN]]


def overview() -> Iterator[str]:
    """Yield the table of the public sets."""
    head = [
        "set",
        "joints",
        "error, median %",
        "worst joint %",
        "R2, worst",
        "intervals agree",
        "torques in 95 %",
        "free run",
        "seconds",
        "verdict",
    ]
    rows = (
        [
            row["title"],
            str(row["joints"]),
            *(f"{of(row['percent'][OWN]):.2g}" if row["percent"][OWN] else "" for of in (median, max)),
            f"{min(row['R2']):.3f}" if row["R2"] else "",
            f"{100 * row['agree']:.0f} %" if row["agree"] else "",
            f"{100 * row['contained']:.0f} %" if row.get("contained") else "",
            "" if row["free_run"] is None else f"{row['free_run']:.2g}",
            f"{row['seconds'][OWN]:.0f}",
            row["verdict"] or "",
        ]
        for row in _rows()
    )
    yield from table(head, rows)


def of_tools() -> Iterator[str]:
    """Yield errors of torque by tool, the median joint and the worst [%]."""
    rows = _with_torques()
    head = ["set", *TOOLS.values()]
    yield from table(head, ([row["title"], *(_pair(row, tool) for tool in TOOLS)] for row in rows))


def _pair(row: Row, tool: str) -> str:
    found = row["percent"].get(tool)
    return f"{_two(median(found))} ({_two(max(found))})" if found else ""


def _two(x: float) -> str:
    """Return a number to two digits, to none from a hundred on."""
    return f"{x:.0f}" if x >= 100 else f"{x:.2g}"


BENCHMARK_TABLES = {
    "benchmark": overview,
    "benchmark-tools": of_tools,
}


def picture(place: Path) -> None:
    """Draw the torque errors of every joint, by set and tool."""
    from set_tables import errors_figure

    sets = [(row["title"], {name: row["percent"].get(tool, []) for tool, name in TOOLS.items()}) for row in _with_torques()]
    errors_figure(sets).savefig(place, dpi=120)


if __name__ == "__main__":
    from tables import DOCS, filled

    keep_benchmark(Path(sys.argv[1]))
    picture(DOCS / "benchmark.png")
    (DOCS / "benchmark.md").write_text(filled((DOCS / "benchmark.md").read_text()))
