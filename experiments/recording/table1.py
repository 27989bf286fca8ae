"""The recording of Table 1: motion, measured against predicted, residuals, parameters, errors."""

from pathlib import Path

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from experiments.recording.arm import send_arm
from experiments.recording.stream import recording_file, send_curves, time_columns
from experiments.recording.style import FORMS, MEASURED, joint_colors, lighter
from experiments.report import markdown
from experiments.table1 import Table1
from identify import Array, Estimate

UNITS = {"explicit": "N m", "implicit": "N m", "power": "W"}
"""The models whose signals are shown, and the unit of their rows."""


def record_table1(path: Path, table: Table1) -> None:
    """Write the recording of `table` to `path`; raise ResultsError if it cannot be written."""
    with recording_file(path, table.scenario.name, _blueprint(table)) as recording:
        times = time_columns(table.log.t, table.log.fs)
        truth = list(table.truth.values())
        send_arm(recording, table.robot, table.log.q, times)
        _send_joints(recording, table, times)
        for chain, estimates in table.estimates.items():
            for form, estimate in estimates.items():
                color = FORMS[form] if chain == table.chains[-1] else MEASURED
                _send_model(recording, chain, form, estimate, color, table.log.fs)
                _send_errors(recording, f"error/{chain}/{form}", estimate.relative_error_percent(truth), form)
        recording.log("report", rr.TextDocument(markdown(table), media_type="text/markdown"), static=True)


def _send_joints(recording: rr.RecordingStream, table: Table1, times: list[rr.TimeColumn]) -> None:
    n, colors = table.log.n, joint_colors(table.log.n)
    for name, values in (("q", table.log.q), ("qd", table.reference.qd), ("tau", table.log.tau)):
        names = [f"{name}{j + 1}" for j in range(n)]
        send_curves(recording, f"joint/{name}", times, values, names, colors, [1.5] * n)


def _send_model(recording: rr.RecordingStream, chain: str, form: str, estimate: Estimate, color: list[int], fs: float) -> None:
    """Send the measured and predicted signal of a model and its residual, an entity for each of its rows."""
    system, groups = estimate.system, np.unique(estimate.system.group)
    for group in groups:
        rows = (system.group == group) & system.valid
        number = f" {group + 1}" if len(groups) > 1 else ""
        times = time_columns(system.time[rows], fs)
        both = np.stack([system.Y[rows], estimate.predicted[rows]], axis=-1)
        path = f"identify/{chain}/{form}"
        labels = [f"measured{number}", f"predicted{number}"]
        shade = lighter(color, int(group))
        send_curves(recording, f"{path}/signal/row{group + 1}", times, both, labels, [MEASURED, shade], [4.0, 1.5])
        residual = estimate.residual[rows, None]
        send_curves(recording, f"{path}/residual/row{group + 1}", times, residual, [f"{chain}{number}"], [shade], [1.5])


def _send_errors(recording: rr.RecordingStream, path: str, error_percent: Array, form: str) -> None:
    """Send a bar a parameter [ppm]; the bars of the models stand side by side."""
    place, slots = list(FORMS).index(form), len(FORMS) + 1
    abscissa = 1 + np.arange(len(error_percent)) + (place - (len(FORMS) - 1) / 2) / slots
    widths = np.full(len(error_percent), 1 / slots)
    bars = rr.BarChart(1e4 * error_percent, abscissa=abscissa, widths=widths, color=FORMS[form])
    recording.log(path, bars, static=True)


def _blueprint(table: Table1) -> rrb.Blueprint:
    """Return the layout: what moves, what was measured, what each model makes of it, what is left, how wrong it is."""
    *_, main = table.chains
    eye = rrb.EyeControls3D(position=(1.15, -1.0, 0.95), look_target=(0.3, 0.0, 0.2), eye_up=(0, 0, 1))
    return rrb.Blueprint(
        rrb.Horizontal(
            rrb.Vertical(
                rrb.Spatial3DView(origin="/world", name="arm", eye_controls=eye),
                rrb.TextDocumentView(origin="/report", name="parameters"),
                row_shares=[5, 4],
            ),
            rrb.Vertical(
                _plot("/joint/q", "q [rad]"),
                _plot("/joint/qd", "qd [rad/s]"),
                _plot("/joint/tau", "tau [N m]"),
                *(_bars(table, chain) for chain in table.chains),
            ),
            rrb.Vertical(*(_plot(f"/identify/{main}/{form}/signal", f"{form} [{UNITS[form]}]") for form in UNITS)),
            rrb.Vertical(*(_residuals(table, form) for form in UNITS)),
            column_shares=[7, 6, 5, 5],
        ),
        rrb.TimePanel(state="collapsed", timeline="sim_time"),
        collapse_panels=True,
    )


def _bars(table: Table1, chain: str) -> rrb.BarChartView:
    legend = rrb.PlotLegend(rrb.Corner2D.LeftTop, visible=chain == table.chains[0])
    return rrb.BarChartView(
        origin=f"/error/{chain}", name=f"error [ppm] of parameters 1 to {len(table.truth)}, {chain}", plot_legend=legend
    )


def _residuals(table: Table1, form: str) -> rrb.TimeSeriesView:
    contents = [f"+ /identify/{chain}/{form}/residual/**" for chain in table.chains]
    return _plot("/identify", f"{form} residual [{UNITS[form]}]", contents)


def _plot(origin: str, name: str, contents: list[str] | None = None) -> rrb.TimeSeriesView:
    linked = rrb.TimeAxis(link=rrb.components.LinkAxis.LinkToGlobal)
    return rrb.TimeSeriesView(origin=origin, name=name, contents=contents or "$origin/**", axis_x=linked)
