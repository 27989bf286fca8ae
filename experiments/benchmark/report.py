"""The page of a benchmark: one HTML file that needs no other."""

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.figure import Figure

from idbench.experiments.benchmark.measures import TORQUE, Row, measure_of
from idbench.experiments.benchmark.tables import HEADS, of_tools, overview, remarks, shares
from idbench.experiments.reports.html import rendered, svg
from idbench.experiments.style import JOINTS


def report(rows: Sequence[Row], failures: Mapping[str, str]) -> str:
    """Return the page of some rows, and why other sets have none."""
    return rendered(
        "idbench.experiments.benchmark",
        "report.html.j2",
        heads=[head.replace("\n", " ") for head in HEADS],
        overview=list(overview(rows)),
        failures=failures,
        figure=svg(errors_figure(rows)) if any(measure_of(row) is TORQUE for row in rows) else "",
        sets=[
            {
                "title": row["title"],
                "measure": measure_of(row).words,
                "joints": row["joints"],
                "tools": list(of_tools(row)),
                "remarks": list(remarks(row)),
            }
            for row in rows
        ],
    )


def errors_figure(rows: Sequence[Row]) -> Figure:
    """Return torque errors of every joint [% of its torque], a line a set that has torques, a colour a tool."""
    rows = [row for row in rows if measure_of(row) is TORQUE]
    tools = list(dict.fromkeys(tool for row in rows for tool in shares(row)))
    figure = Figure(figsize=(8, 1.0 + 0.5 * len(rows)), layout="constrained")
    panel = figure.subplots()
    for k, tool in enumerate(tools):
        height = 0.6 * ((k + 0.5) / len(tools) - 0.5)
        places = [(share, y + height) for y, row in enumerate(rows) for share in shares(row).get(tool, ())]
        x, y = np.array(places).reshape(-1, 2).T
        color = [c / 255 for c in JOINTS[k % len(JOINTS)]]
        panel.plot(x, y, ".", color=color, label=tool, markersize=7)
    panel.set_yticks(range(len(rows)), [row["title"] for row in rows], parse_math=False)
    panel.invert_yaxis()
    panel.set_xscale("log")
    panel.set_xlabel("torque error of a joint on held-out logs [% of its torque]")
    figure.legend(loc="outside upper right", ncols=4, frameon=False)
    return figure
