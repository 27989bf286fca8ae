"""The units of columns, as far as names and values say: what a guess of their layout ends with."""

import re
from dataclasses import replace

import numpy as np

from idbench.identify.arrays import Array
from idbench.identify.files.layout import Asked, LogLayout, Source
from idbench.identify.files.table import POSITIONS, SI, LogTable, factor, gain_wanted, named_unit, needs_gain

FEWEST = 10  # Rows that a guess by values takes
CURRENTS = ("current", "currents", "cur", "amps")

SAY_UNIT = "say its unit, --units q=deg, mrad, rev, or count:COUNTS_OF_A_TURN@COUNT_AT_ZERO"
FARTHEST = 4 * np.pi  # Positions [rad] beyond which degrees are suspected
MOST_DEGREES = 720.0  # Positions beyond which they are no degrees of an arm, which turns twice at most
STRONGEST = 3e3  # Torques [N m] beyond which mN m are suspected


def with_units(layout: LogLayout, table: LogTable, asked: Asked) -> tuple[LogLayout, list[str]]:
    """Return a layout with units as asked, by the names of columns, or else by the size of their values, and doubts."""
    doubts = list[str]()
    for name in ("t", "q", "tau", "qd", "qdd"):  # velocities last: their unit follows from those before
        source: Source = getattr(layout, name)
        names = [column for column in source.names(list(table.columns)) if column in table.columns]
        if not names or name in asked.units:
            continue
        stated = named_unit(name, names[0])
        unit = stated or (_suspected(name, layout, table) if table.rows >= FEWEST else "")
        if name == "q" and not stated and (most := _largest(table, source)) > MOST_DEGREES:
            doubts.append(f"q reaches {most:.5g}: {SAY_UNIT}")
        elif (
            unit and not stated and unit not in (SI[name], "A") and not (layout.samples and name in ("qd", "qdd"))
        ):  # currents are asked for their gain
            doubts.append(f"{name} in {unit}? Its values, or names, look like it: say --units {name}={unit}, or what it is in")
        layout = layout.where(name, replace(source, unit=unit))
    if not layout.t.columns and not layout.t.fs and not layout.samples:
        doubts.append("it has no column of times that idbench recognises: say which with --columns t=NAME, or state fs in [t]")
    if needs_gain(layout.tau.unit) and not layout.gain:
        doubts.append(gain_wanted(layout.tau.unit))
    return layout, doubts


def _suspected(quantity: str, layout: LogLayout, table: LogTable) -> str:
    """Return the unit that values look like; empty for SI."""
    if quantity == "t":
        return unit_of_times(table.columns[layout.t.columns[0]])
    if quantity == "q":
        return "deg" if FARTHEST < _largest(table, layout.q) <= MOST_DEGREES else ""
    if quantity in ("qd", "qdd"):
        if layout.samples:  # of which nothing else is known
            return f"{layout.q.unit}{'/s' if quantity == 'qd' else '/s^2'}" if layout.q.unit in POSITIONS else ""
        return _velocity_unit(table, layout) if quantity == "qd" else ""
    if any(word in re.findall("[a-z]+", name.lower()) for name in layout.tau.names(list(table.columns)) for word in CURRENTS):
        return "mA" if _largest(table, layout.tau) > STRONGEST / 10 else "A"
    return "mN m" if _largest(table, layout.tau) > STRONGEST else ""


def _values(table: LogTable, source: Source) -> Array:
    """Return the columns of a source, shape (row, column), to the end of the shortest."""
    columns = [table.columns[name] for name in source.names(list(table.columns)) if name in table.columns]
    rows = min(map(len, columns))
    return np.concatenate([column[:rows].reshape(rows, -1) for column in columns], axis=1)


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
