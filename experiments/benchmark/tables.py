"""Rows of a benchmark as tables."""

from collections.abc import Iterator, Sequence

import numpy as np
from rich.console import Console
from rich.text import Text

from idbench.experiments.benchmark.measures import TORQUE, Row, measure_of, of_logs, pooled
from idbench.experiments.text import new_table, percentage, print_table
from idbench.identify import Array

OWN = "idbench"
"""What our own row is called beside those of other tools."""

HEADS = (
    "joints",
    "torque error\nmedian %",
    "torque error\nworst %",
    "R2\nmedian",
    "R2\nworst",
    "intervals\nagree",
    "free run\nNRMSE",
    "fit\nseconds",
    "verdict",
)
"""Columns of the table of all sets, beside their names."""


def overview(rows: Sequence[Row]) -> Iterator[list[str]]:
    """Yield the cells of each set: how well torques of held-out logs are predicted, and what the protocol asks for."""
    for row in rows:
        percent, R2, free = share(row, row["logs"]), worst_R2(row), free_run(row)
        yield [
            row["title"],
            str(len(row["joints"])),
            *(percentage(x) if np.isfinite(x) else "" for x in (_median(percent), _largest(percent))),
            *(f"{x:.3f}" if np.isfinite(x) else "" for x in (_median(R2), -_largest(-R2))),
            _agree(row["repeats"]),
            f"{free:.3f}" if np.isfinite(free) else "",
            f"{row['seconds']:.2g}",
            row["verdict"] or "",
        ]


def of_tools(row: Row) -> Iterator[list[str]]:
    """Yield the errors of each joint over all held-out logs, by each tool, with seconds."""
    measure = measure_of(row)
    for tool, logs, seconds in _tools(row):
        errors = pooled(logs, measure.name, measure.over_logs)
        yield [tool, *(f"{x:.3g}" if np.isfinite(x) else "" for x in errors), "" if seconds is None else f"{seconds:.2g}"]


def print_rows(console: Console, rows: Sequence[Row]) -> None:
    """Print the table of all sets, and of each the joints by tool."""
    grid = new_table("", HEADS)
    for cells in overview(rows):
        grid.add_row(*cells)
    grid.columns[0].header = "set"
    print_table(console, grid)
    for row in rows:
        _print_set(console, row)


def _print_set(console: Console, row: Row) -> None:
    console.print(Text(f"{row['title']}: {measure_of(row).words}", style="bold"), soft_wrap=True)
    grid = new_table("", [*row["joints"], "seconds"])
    for cells in of_tools(row):
        grid.add_row(*cells)
    print_table(console, grid)
    for words in remarks(row):
        console.print(Text(words), soft_wrap=True)
    console.print()


def remarks(row: Row) -> Iterator[str]:
    """Yield what else is to be said of a set."""
    for log in row["logs"]:
        if "failure" in log:
            yield f"{log['title']}: {log['failure']}"
        elif log["samples_seen"]:
            yield (
                f"{log['title']}: {log['samples_seen']} of its {log['samples']} samples are also in the fitted logs, which the "
                "fit has seen"
            )
    for part in (row["repeats"], *row.get("free_run", ())):
        yield from [part["failure"]] if "failure" in part else []
        yield from part.get("failed", ())
        if part.get("diverged"):
            yield f"{part['diverged']} of {part['stretches']} free runs diverge"
    for tool, found in row["tools"].items():
        yield from (f"{tool}: {part['failure']}" for part in (found, *found.get("logs", ())) if "failure" in part)
    yield from row.get("verdicts", ())
    yield from [f"not saved: {row['unsaved']}"] if "unsaved" in row else []
    if row["published"]:
        yield f"published: {row['published']}"


def _tools(row: Row) -> Iterator[tuple[str, Sequence[Row], float | None]]:
    yield f"{OWN}, {row['model']}, {row['estimator']}", row["logs"], row["seconds"]
    for tool, found in row["tools"].items():
        if any("failure" not in log for log in found.get("logs", ())):
            yield tool, found["logs"], found["seconds"]


def share(row: Row, logs: Sequence[Row]) -> Array:
    """Return the torque error of each joint over its torque, both over all logs [%], shape (joint,)."""
    errors, level = pooled(logs, TORQUE.name), pooled(row["logs"], "torque_rms")
    return 100 * errors / np.where(level > 0, level, np.nan) if len(errors) else errors


def worst_R2(row: Row) -> Array:
    """Return the least R2 of each joint over the logs, shape (joint,); nothing if no log has it."""
    each = of_logs(row["logs"], "R2")
    return each.min(axis=0) if len(each) else np.zeros(0)


def free_run(row: Row) -> float:
    """Return the NRMSE of free runs of the median joint, rms over logs; NaN if there is none."""
    return _median(pooled(row.get("free_run", ()), "nrmse"))


def _median(x: Array) -> float:
    known = x[np.isfinite(x)]
    return float(np.median(known)) if len(known) else float("nan")


def _largest(x: Array) -> float:
    known = x[np.isfinite(x)]
    return float(known.max()) if len(known) else float("nan")


def _agree(found: Row) -> str:
    return f"{100 * found['inside'] / found['compared']:.0f} %" if found.get("compared") else ""


def shares(row: Row) -> dict[str, list[float]]:
    """Return the torque errors of each joint over its torque [%], by tool."""
    every = {tool: share(row, logs) for tool, logs, _ in _tools(row)}
    return {(OWN if tool.startswith(OWN) else tool): [float(x) for x in e if np.isfinite(x)] for tool, e in every.items()}
