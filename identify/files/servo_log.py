"""Logs of servos on disk: t, q, command, and where they were logged whether torque is on and the supply voltage."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import final

import numpy as np

from idbench.identify.arrays import Array
from idbench.identify.errors import LogError, SettingError
from idbench.identify.files.formats import read_table
from idbench.identify.files.layout import matching
from idbench.identify.files.table import LogTable
from idbench.identify.files.units import factor

QUANTITIES = {"t": "t", "q": "q", "command": "q", "on": "", "voltage": ""}
"""What columns may be, and whose units they have."""

PATTERNS = {"t": "t", "q": "q*", "command": "command*", "on": "on*", "voltage": "voltage*"}
"""How they are called where nobody says otherwise."""

OPTIONAL = ("on", "voltage")


@final
@dataclass(frozen=True, eq=False)
class ServoColumns:
    """Columns of a log of servos, in SI units."""

    t: Array
    """Shape (time,) [s]."""
    q: Array
    """Shape (time, joint) [rad]."""
    command: Array
    """Shape (time, joint) [rad]."""
    on: Array | None
    """Above 0.5 where torque is enabled, shape (time, joint)."""
    voltage: Array | None
    """Shape (time, joint) [V]."""
    joints: tuple[str, ...]
    """Names of the joints, where the columns have them."""


def read_servo_log(path: Path, columns: Mapping[str, str], units: Mapping[str, str]) -> ServoColumns:
    """Return the columns of a log of servos.

    Parameters
    ----------
    path : Path
        CSV or other text, Parquet, NumPy, Matlab, a ROS bag.
    columns, units : mapping of str to str
        Names of columns (a * stands for numbers or names of joints, or a list with commas) and units, by quantity.

    Raises
    ------
    LogError
        If it cannot be read, or lacks a column.
    SettingError
        If a quantity or a unit is unknown.
    """
    for quantity in (*columns, *units):
        if quantity not in QUANTITIES:
            raise SettingError(f"{quantity!r} is no quantity of a servo's log; known: {', '.join(QUANTITIES)}")
    table = read_table(path)
    found = {name: _of(path, table, name, columns.get(name), units.get(name, "")) for name in QUANTITIES}
    joints = found["q"][1] or found["command"][1]
    t, q, command = (found[name][0] for name in ("t", "q", "command"))
    if q.shape != command.shape:
        raise LogError(f"{path} has {q.shape[1]} columns of positions and {command.shape[1]} of commands: one of each a joint")
    on, voltage = (
        np.broadcast_to(found[name][0], q.shape) if found[name][0].shape[1] in (1, q.shape[1]) else None for name in OPTIONAL
    )
    return ServoColumns(t[:, 0], q, command, on, voltage, joints)


def _of(path: Path, table: LogTable, quantity: str, stated: str | None, unit: str) -> tuple[Array, tuple[str, ...]]:
    """Return the columns of a quantity in SI, shape (time, joint), and the names of joints that they have."""
    names, columns = list(table.columns), list[Array]()
    joints = list[str]()
    for pattern in (stated or PATTERNS[quantity]).split(","):
        plain = pattern.replace("*", "") if stated is None else pattern  # a log of one joint needs no number
        inside = [(plain, "")] if plain in names else matching(pattern, names) if "*" in pattern else []
        if not inside and not (stated is None and quantity in OPTIONAL):
            raise LogError(
                f"{path} has no column {pattern} for {quantity}; its columns: {', '.join(names[:40])}. Name it: "
                f"--columns {quantity}=NAME"
            )
        columns += [table.columns[name] for name, _ in inside]
        joints += [place.removeprefix("_") for _, place in inside if place and not place.isdigit()]
    if not columns:
        return np.empty((0, 0)), ()
    if any(column.ndim != 1 for column in columns):
        raise LogError(f"{path}: columns of {quantity} must hold one number a row")
    if wrong := [k for column in columns for k in np.flatnonzero(~np.isfinite(column))]:
        raise LogError(f"{path}: {quantity} is missing at sample {wrong[0]}; remove or repair such samples first")
    scale = factor(QUANTITIES[quantity], unit) if unit and QUANTITIES[quantity] else 1.0
    return np.stack(columns, axis=1) * scale, tuple(joints) if len(joints) == len(columns) else ()


def order(columns: ServoColumns, joints: Sequence[str], path: Path) -> list[int]:
    """Return which column belongs to each of the joints; raise LogError if the log does not have them all."""
    if columns.joints:
        if missing := [joint for joint in joints if joint not in columns.joints]:
            raise LogError(f"{path} names the joints {', '.join(columns.joints)}; the robot's {', '.join(missing)} is missing")
        return [columns.joints.index(joint) for joint in joints]
    if columns.q.shape[1] != len(joints):
        raise LogError(
            f"{path}: number of positions {columns.q.shape[1]}, joints of the robot {len(joints)}: {', '.join(joints)}; --lock "
            "NAME=VALUE holds those that the log does not have"
        )
    return list(range(len(joints)))
