"""The recording of Table 2: the twin's signals, its errors by both processings, and what each imperfection does alone."""

from pathlib import Path

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from experiments.recording.arm import send_arm
from experiments.recording.parts import layout, plot, send_bars, send_joints
from experiments.recording.stream import recording_file, time_columns
from experiments.table2 import PAPER, Table2
from identify import Array

FLOOR = 0.01
"""Error [%] at which the bars begin; every unit of their height is a decade more."""

ROWS = 5
"""Charts of imperfections in a column."""


def record_table2(path: Path, table: Table2) -> None:
    """Write the recording of `table` to `path`; raise ResultsError if it cannot be written."""
    run = table.run
    with recording_file(path, table.scenario.name, _blueprint(table)) as recording:
        times = time_columns(run.log.t, run.log.fs)
        send_arm(recording, run.robots[0], run.q[0], times)
        disturbance = run.tau[0] - run.command[0]
        send_joints(recording, times, {"joint/tau": run.log.tau[0], "joint/disturbance": disturbance})
        for name, found in table.found.items():
            for form, one in found.items():
                errors = one.estimates[form].error_percent(list(table.truth.values()))
                send_bars(recording, f"processing/{name}/{form}", _decades(errors), form)
        for k, alone in enumerate(table.attribution.values()):
            for form, error in alone.items():
                send_bars(recording, f"attribution/{k}/{form}", _decades(error), form)
        recording.log("report", rr.TextDocument(_markdown(table), media_type="text/markdown"), static=True)


def _decades(error_percent: Array) -> Array:
    """Return how many decades an error is above FLOOR, with its sign."""
    return np.sign(error_percent) * np.log10(1 + np.abs(error_percent) / FLOOR)


def _blueprint(table: Table2) -> rrb.Blueprint:
    names = list(table.attribution)
    hidden = rrb.PlotLegend(visible=False)
    charts = [rrb.BarChartView(origin=f"/attribution/{k}", name=name, plot_legend=hidden) for k, name in enumerate(names)]
    columns = [rrb.Vertical(*charts[k : k + ROWS]) for k in range(0, len(charts), ROWS)]
    signals = rrb.Vertical(
        plot("/joint/tau", "tau in the log [N m]"),
        plot("/joint/disturbance", "true minus commanded torque [N m]"),
        *(rrb.BarChartView(origin=f"/processing/{name}", name=f"processed as {name}") for name in table.found),
    )
    return layout("Table 2", [3, 5], [signals, *columns], [6, 4, *([4] * len(columns))])


def _markdown(table: Table2) -> str:
    """Return the explicit and the power model's estimates beside the paper's, and how to read the bars."""
    lines = ["| | true | | paper | paper's steps | idbench |", "|---|---:|---|---:|---:|---:|"]
    for i, (name, true) in enumerate(table.truth.items()):
        for form in ("explicit", "power"):
            X = [found[form].estimates[form].X[i] for found in table.found.values()]
            head = f"{i + 1} {name} | {true:g}" if form == "explicit" else " | "
            lines.append(f"| {head} | {form} | {PAPER[form].estimate[i]:g} | {' | '.join(f'{x:.4g}' for x in X)} |")
    return "\n".join([*lines, f"\nBars: error of parameters 1 to 8 in decades above {FLOOR} %; 4 is 100 %."])
