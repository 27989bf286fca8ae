"""The recording of Table 1: motion, measured against predicted, residuals, parameters, errors."""

from pathlib import Path

import rerun as rr
import rerun.blueprint as rrb

from experiments.recording.arm import send_arm
from experiments.recording.parts import UNITS, layout, plot, send_bars, send_joints, send_model
from experiments.recording.stream import recording_file, time_columns
from experiments.recording.style import FORMS, MEASURED
from experiments.report import markdown
from experiments.table1 import Table1


def record_table1(path: Path, table: Table1) -> None:
    """Write the recording of `table` to `path`; raise ResultsError if it cannot be written."""
    with recording_file(path, table.scenario.name, _blueprint(table)) as recording:
        times = time_columns(table.log.t, table.log.fs)
        truth = list(table.truth.values())
        send_arm(recording, table.robot, table.log.q, times)
        signals = {"joint/q": table.log.q, "joint/qd": table.reference.qd, "joint/tau": table.log.tau}
        send_joints(recording, times, signals)
        for chain, estimates in table.estimates.items():
            for form, estimate in estimates.items():
                color = FORMS[form] if chain == table.chains[-1] else MEASURED
                send_model(recording, chain, form, estimate, color, table.log.fs)
                send_bars(recording, f"error/{chain}/{form}", 1e4 * estimate.relative_error_percent(truth), form)
        recording.log("report", rr.TextDocument(markdown(table), media_type="text/markdown"), static=True)


def _blueprint(table: Table1) -> rrb.Blueprint:
    """Return the layout: what moves, what was measured, what each model makes of it, what is left, how wrong it is."""
    *_, main = table.chains
    columns = [
        rrb.Vertical(
            plot("/joint/q", "q [rad]"),
            plot("/joint/qd", "qd [rad/s]"),
            plot("/joint/tau", "tau [N m]"),
            *(_bars(table, chain) for chain in table.chains),
        ),
        rrb.Vertical(*(plot(f"/identify/{main}/{form}/signal", f"{form} [{UNITS[form]}]") for form in UNITS)),
        rrb.Vertical(*(_residuals(table, form) for form in UNITS)),
    ]
    return layout("parameters", [5, 4], columns, [7, 6, 5, 5])


def _bars(table: Table1, chain: str) -> rrb.BarChartView:
    legend = rrb.PlotLegend(rrb.Corner2D.LeftTop, visible=chain == table.chains[0])
    return rrb.BarChartView(
        origin=f"/error/{chain}", name=f"error [ppm] of parameters 1 to {len(table.truth)}, {chain}", plot_legend=legend
    )


def _residuals(table: Table1, form: str) -> rrb.TimeSeriesView:
    contents = [f"+ /identify/{chain}/{form}/residual/**" for chain in table.chains]
    return plot("/identify", f"{form} residual [{UNITS[form]}]", contents)
