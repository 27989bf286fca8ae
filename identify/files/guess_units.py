"""The units of columns, as far as names and values say: what a guess of their layout ends with."""

import re
from dataclasses import replace

import numpy as np

from idbench.identify.arrays import Array
from idbench.identify.files.layout import LogLayout, Source
from idbench.identify.files.table import SI, LogTable, factor, named_unit

CURRENTS = ("current", "currents", "cur", "amps")

FARTHEST = 4 * np.pi  # Positions [rad] beyond which degrees are suspected
STRONGEST = 3e3  # Torques [N m] beyond which mN m are suspected


def with_units(layout: LogLayout, table: LogTable) -> tuple[LogLayout, list[str]]:
    """Return a layout with units by the names of columns, or else by the size of their values, and doubts."""
    doubts = list[str]()
    for name in ("t", "q", "tau", "qd"):  # velocities last: their unit follows from those before
        source: Source = getattr(layout, name)
        if not source.columns:
            continue
        stated = named_unit(name, source.logged[0])
        unit = stated or _suspected(name, layout, table)
        if unit and not stated and unit != SI[name]:
            doubts.append(f"{name} in {unit}? Its values, or names, look like it: identify needs --units {name}={unit}")
        layout = layout.where(name, replace(source, unit=unit))
    if not layout.t.columns:
        doubts.append("no column of times: state fs = ... [Hz] in [t]")
    if layout.tau.unit in ("A", "mA"):
        doubts.append("efforts in A: state gain = [...] in [torque], N m/A of each joint, gears included")
    return layout, doubts


def _suspected(quantity: str, layout: LogLayout, table: LogTable) -> str:
    """Return the unit that values look like; empty for SI."""
    if quantity == "t":
        return unit_of_times(table.columns[layout.t.columns[0]])
    if quantity == "q":
        return "deg" if _largest(table, layout.q) > FARTHEST else ""
    if quantity == "qd":
        return _velocity_unit(table, layout)
    if any(word in re.findall("[a-z]+", name.lower()) for name in layout.tau.logged for word in CURRENTS):
        return "mA" if _largest(table, layout.tau) > STRONGEST / 10 else "A"
    return "mN m" if _largest(table, layout.tau) > STRONGEST else ""


def _values(table: LogTable, source: Source) -> Array:
    """Return the columns of a source, shape (row, column), to the end of the shortest."""
    rows = min(len(table.columns[name]) for name in source.logged)
    return np.concatenate([table.columns[name][:rows].reshape(rows, -1) for name in source.logged], axis=1)


def _largest(table: LogTable, source: Source) -> float:
    return float(np.nanmax(np.abs(_values(table, source)), initial=0.0))


def unit_of_times(t: Array) -> str:
    """Return the unit that times look like by their steps; empty for s."""
    step = float(np.nanmedian(np.diff(t)))
    return next((unit for unit, largest in (("", 0.5), ("ms", 200.0), ("us", 2e5)) if step < largest), "ns")


def _velocity_unit(table: LogTable, layout: LogLayout) -> str:
    """Return the unit of velocities in which they are the derivatives of the positions."""
    if not layout.t.columns or not layout.q.columns:
        return ""
    t = table.columns[layout.t.columns[0]] * factor("t", layout.t.unit or "s")
    q = _values(table, layout.q) * factor("q", layout.q.unit or "rad")
    v, given = np.gradient(np.nan_to_num(q), axis=0) / max(float(np.nanmedian(np.diff(t))), 1e-12), _values(table, layout.qd)
    given = np.nan_to_num(given)
    if v.shape != given.shape or not np.any(v):
        return ""
    ratio = float(np.sum(v * given) / np.sum(v * v))
    sizes = {unit: abs(np.log(abs(ratio) * factor("qd", unit))) for unit in ("rad/s", "deg/s", "mrad/s", "rpm") if ratio}
    return min(sizes, key=lambda unit: sizes[unit]) if sizes else ""
