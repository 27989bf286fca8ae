"""Parts that recordings are made of."""

from collections.abc import Mapping, Sequence

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from experiments.recording.stream import send_curves, time_columns
from experiments.recording.style import FORMS, MEASURED, joint_colors, lighter
from identify import Array, Estimate

UNITS = {"explicit": "N m", "implicit": "N m", "power": "W"}
"""The models whose signals are shown, and the unit of their rows."""

EYE = rrb.EyeControls3D(position=(1.15, -1.0, 0.95), look_target=(0.3, 0.0, 0.2), eye_up=(0, 0, 1))


def send_joints(recording: rr.RecordingStream, times: Sequence[rr.TimeColumn], signals: Mapping[str, Array]) -> None:
    """Send signals of the joints, shape (time, joint) each, a curve a joint."""
    for path, values in signals.items():
        n, name = values.shape[1], path.rsplit("/", 1)[-1]
        names = [f"{name}{j + 1}" for j in range(n)]
        send_curves(recording, path, times, values, names, joint_colors(n), [1.5] * n)


def send_model(recording: rr.RecordingStream, chain: str, form: str, estimate: Estimate, color: list[int], fs: float) -> None:
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


def send_bars(recording: rr.RecordingStream, path: str, values: Array, form: str) -> None:
    """Send a bar a parameter; the bars of the models stand side by side."""
    place, slots = list(FORMS).index(form), len(FORMS) + 1
    abscissa = 1 + np.arange(len(values)) + (place - (len(FORMS) - 1) / 2) / slots
    widths = np.full(len(values), 1 / slots)
    recording.log(path, rr.BarChart(values, abscissa=abscissa, widths=widths, color=FORMS[form]), static=True)


def plot(origin: str, name: str, contents: list[str] | None = None) -> rrb.TimeSeriesView:
    """Return a view of curves over time, its time axis that of all others."""
    linked = rrb.TimeAxis(link=rrb.components.LinkAxis.LinkToGlobal)
    return rrb.TimeSeriesView(origin=origin, name=name, contents=contents or "$origin/**", axis_x=linked)


def layout(report: str, rows: list[float], columns: Sequence[rrb.Vertical], shares: list[float]) -> rrb.Blueprint:
    """Return the layout of a recording: the arm above the report, named `report`, and then columns of views."""
    first = rrb.Vertical(
        rrb.Spatial3DView(origin="/world", name="arm", eye_controls=EYE),
        rrb.TextDocumentView(origin="/report", name=report),
        row_shares=rows,
    )
    time = rrb.TimePanel(state="collapsed", timeline="sim_time")
    return rrb.Blueprint(rrb.Horizontal(first, *columns, column_shares=shares), time, collapse_panels=True)
