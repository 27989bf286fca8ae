"""Rows of a benchmark as tables."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from rich.console import Console
from rich.text import Text

from idbench.experiments.text import JOINTS, new_table, percentage, print_table
from idbench.identify import Array

Row = Mapping[str, Any]


@dataclass(frozen=True)
class Measure:
    """An error of held-out logs."""

    name: str
    """What summaries call it."""
    words: str
    """What it is."""
    over_logs: Callable[[Array], Array]
    """What is said of several logs, of shape (log, joint)."""


def rms(each: Array) -> Array:
    """Return the rms over logs, shape (joint,)."""
    return np.sqrt((each**2).mean(axis=0))


def mean(each: Array) -> Array:
    """Return the mean over logs, shape (joint,)."""
    found: Array = each.mean(axis=0)
    return found


TORQUE = Measure("torque_error_rms", "torque error on held-out logs, rms [N m, N]", rms)
POSITION = Measure("position_error", "position on held-out logs, from commands alone, mean absolute error [rad]", mean)


def row_measure(row: Row) -> Measure:
    """Return what a row is judged by."""
    return POSITION if any(POSITION.name in log for log in row["logs"]) else TORQUE


def pooled(logs: Sequence[Row], name: str, over_logs: Callable[[Array], Array] = rms) -> Array:
    """Return a figure of each joint over all logs that have it, shape (joint,); nothing if none has."""
    each = of_logs(logs, name)
    return over_logs(each) if len(each) else np.zeros(0)


def of_logs(logs: Sequence[Row], name: str) -> Array:
    """Return a figure of each log that has it and joint, shape (log, joint)."""
    return np.array([[np.nan if x is None else x for x in log[name]] for log in logs if name in log], dtype=float)


OWN = "idbench"  # What our own row is called beside those of other tools

HEADS = (
    "joints",
    "torque error\nmedian %",
    "torque error\nworst %",
    "R2\nmedian",
    "R2\nworst",
    "intervals\nagree",
    "torques in\n95 %",
    "free run\nNRMSE",
    "fit\nseconds",
    "verdict",
)
"""Columns of the table of all sets, beside their names."""


def overview(rows: Sequence[Row]) -> Iterator[list[str]]:
    """Yield the cells of each set: how well torques of held-out logs are predicted, and what the protocol asks for."""
    for row in rows:
        percent = share(row, row["logs"])
        R2 = worst_R2(row)
        free = free_run(row)
        yield [
            row["title"],
            str(len(row["joints"])),
            *(percentage(x) if np.isfinite(x) else "" for x in (_median(percent), _largest(percent))),
            *(f"{x:.3f}" if np.isfinite(x) else "" for x in (_median(R2), -_largest(-R2))),
            _agree(row["repeats"]),
            _contained(row["logs"]),
            f"{free:.3f}" if np.isfinite(free) else "",
            f"{row['seconds']:.2g}",
            row["verdict"] or "",
        ]


def _contained(logs: Sequence[Row]) -> str:
    """Return how many of the held-out torques lie in their intervals [%]; empty where that is not known."""
    inside = of_logs(logs, "within_interval")
    return f"{100 * np.nanmean(inside):.0f} %" if np.isfinite(inside).any() else ""


def of_tools(row: Row) -> Iterator[list[str]]:
    """Yield the errors of each joint over all held-out logs, by each tool, with seconds."""
    measure = row_measure(row)
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
    console.print(Text(f"{row['title']}: {row_measure(row).words}", style="bold"), soft_wrap=True)
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
    yield from (beside_published(row, one) for one in row["published"])


def beside_published(row: Row, published: Row) -> str:
    """Return a published figure beside the row's own by the same metric."""
    ours, unit = METRICS[published["metric"]]
    own = ours(row)
    mine = f"{own:.3g}{unit}" if np.isfinite(own) else "not known"
    lengths = {f"{one['length']:g} s" for one in row.get("free_run", ()) if "length" in one}
    mine += f" in stretches of {' and '.join(lengths)}" if lengths and published["metric"] == "free run" else ""
    return (
        f"{published['metric']}: {OWN} {mine} on the held-out logs of this set; published {published['value']:g}{unit} "
        f"({published['by']}: {published['split']})"
    )


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


METRICS: Mapping[str, tuple[Callable[[Row], float], str]] = {
    "torque error": (lambda row: _median(share(row, row["logs"])), " %"),
    "position error": (lambda row: _median(pooled(row["logs"], POSITION.name, mean)), " rad"),
    "free run": (free_run, " (NRMSE)"),
}
"""Figures of a row that others publish, and their units."""


def _median(x: Array) -> float:
    known = x[np.isfinite(x)]
    return float(np.median(known)) if len(known) else float("nan")


def _largest(x: Array) -> float:
    known = x[np.isfinite(x)]
    return float(known.max()) if len(known) else float("nan")


def _agree(found: Row) -> str:
    return f"{100 * found['inside'] / found['compared']:.0f} %" if found.get("compared") else ""


def errors_figure(sets: Sequence[tuple[str, Mapping[str, Sequence[float]]]]) -> Figure:
    """Return torque errors of every joint [% of its torque], by set and tool: a line a set, a colour a tool."""
    tools = list(dict.fromkeys(tool for _, each in sets for tool in each))
    figure = Figure(figsize=(8, 1.2 + 0.8 * len(sets)), layout="constrained")
    panel = figure.subplots()
    for k, tool in enumerate(tools):
        height = 0.6 * ((k + 0.5) / len(tools) - 0.5)
        color = [c / 255 for c in JOINTS[k % len(JOINTS)]]
        panel.plot([], [], "s", color=color, label=tool)
        for y, (_, each) in enumerate(sets):
            for j, share in enumerate(each.get(tool, ())):
                panel.plot(share, y + height, marker=f"${j + 1}$", color=color, markersize=6.5, markeredgewidth=0.4)
    panel.set_yticks(range(len(sets)), [title for title, _ in sets], parse_math=False)
    panel.invert_yaxis()
    panel.set_xscale("log")
    panel.xaxis.set_major_formatter("{x:g}")
    panel.set_xlabel("held-out torque error [% of the torque]; numbers are joints, left is better")
    figure.legend(loc="outside upper right", ncols=5, frameon=False)
    return figure
