"""Logs of servos on disk: t, q, command, and where they were logged whether torque is on and the supply voltage."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from idbench.identify.arrays import Array
from idbench.identify.errors import LogError
from idbench.identify.files.formats import read_table
from idbench.identify.files.guess import EPISODES
from idbench.identify.files.guess_units import FARTHEST, unit_of_times
from idbench.identify.files.layout import Asked, LogLayout, Source, matching
from idbench.identify.files.lerobot import data_file
from idbench.identify.files.log_files import LogFiles
from idbench.identify.files.table import LogTable, factor

USUAL: Mapping[str, tuple[str, ...]] = {
    "t": ("t", "time", "timestamp"),
    "q": ("q*", "position", "observation.state"),
    "command": ("command*", "ctrl*", "action"),
    "forward": ("forward*",),
    "velocity": ("velocity_command*", "qd_command*", "qd_des*", "dq_des*"),
    "on": ("on*",),
    "voltage": ("voltage*",),
}
"""How columns are called where nobody says otherwise; those of LeRobot last."""

NAME_IT = "Name it: --columns command=NAME, a * in it for numbers or names of joints"  # The way out where a column is not found

OPTIONAL = ("forward", "velocity", "on", "voltage")


@dataclass(frozen=True, eq=False)
class ServoColumns:
    """Columns of a log of servos, in SI units."""

    t: Array
    """Shape (time,) [s]."""
    q: Array
    """Positions [rad], shape (time, joint)."""
    command: Array
    """Commanded positions [rad], shape (time, joint)."""
    on: Array | None
    """Above 0.5 where torque is enabled, shape (time, joint)."""
    voltage: Array | None
    """Shape (time, joint) [V]."""
    joints: tuple[str, ...] = ()
    """Names of the joints, where the columns have them."""
    commanded: tuple[str, ...] = ()
    """Names of joints or actuators that are commanded, where the columns have them."""
    forward: Array | None = None
    """Commanded beside the angle: duty, torque [N m] or current [A], shape (time, joint)."""
    velocity: Array | None = None
    """Commanded velocities, which kd multiplies [rad/s], shape (time, joint)."""


def read_servo_log(path: Path, asked: Asked = Asked()) -> tuple[ServoColumns, str]:  # noqa: B008  # frozen
    """Return the columns of a log of servos, and what was assumed of them in words; empty if nothing was.

    Parameters
    ----------
    path : Path
        CSV or other text, Parquet, a data set of LeRobot, NumPy, Matlab, a ROS bag.
    asked : Asked, optional
        What is said of its columns; all else is as `log.toml` beside it says, or called as in `USUAL`, in SI units.

    Raises
    ------
    LogError
        If it cannot be read, or lacks a column.
    """
    path = data_file(path)
    table = read_table(path)
    beside = LogLayout.beside(path)
    layout = _stated(path, table, beside[0] if beside else LogLayout(), asked)
    files = LogFiles(path, path.parent, layout, {path: table})
    found = {name: files.of(name, of) for name in USUAL if name != "t" and (of := getattr(layout, name)).columns}
    q, command = found["q"][0], found["command"][0]
    if len(q) != len(command):
        raise LogError(f"{path}: {len(q)} samples of positions and {len(command)} of commands: one of each at every time")
    if q.shape != command.shape:
        both = f"{q.shape[1]} columns of positions and {command.shape[1]} of commands: one of each a joint"
        raise LogError(f"{path} has {both}; of velocities: --columns command=NAME velocity=NAME")
    t = files.times(layout.q, len(q))
    _require_radians(path, layout, {"q": q, "command": command})
    _require_complete(path, {"t": t, **{name: x for name, (x, _) in found.items()}})
    _require_steady(path, table, t)
    said = ""
    if not layout.t.unit and (unit := unit_of_times(t)):
        t, said = t * factor("t", unit), f"{path.name}: times in {unit}, by their size; --units t=s if they are in s"
    forward, velocity, on, voltage = (
        np.broadcast_to(found[name][0], q.shape) if name in found and found[name][0].shape[1] in (1, q.shape[1]) else None
        for name in OPTIONAL
    )
    joints = layout.joints or found["q"][1] or found["command"][1]
    return ServoColumns(t - t[0], q, command, on, voltage, joints, found["command"][1], forward, velocity), said


def _stated(path: Path, table: LogTable, layout: LogLayout, asked: Asked) -> LogLayout:
    """Return the layout that is stated, by options before the file beside the log before the usual names."""
    every, layout = [*table.columns, *table.words], asked.over(layout)
    for name, usual in USUAL.items():
        source: Source = getattr(layout, name)
        if name in asked.columns:
            if lacking := [x for x in source.columns if not _is_there((x,), every)]:
                raise LogError(f"{path} has no column {lacking[0]} for {name}; its columns: {', '.join(every[:40])}. {NAME_IT}")
        elif not _is_there(source.columns, every):
            called = next((x for x in usual if _is_there((x,), every) or x.replace("*", "") in every), None)
            if called is None and name not in OPTIONAL:
                raise LogError(f"{path} has no column {usual[0]} for {name}; its columns: {', '.join(every[:40])}. {NAME_IT}")
            plain = called is not None and "*" in called and called.replace("*", "") in every
            called = called.replace("*", "") if called and plain else called
            layout = layout.where(name, replace(source, columns=(called,) if called else ()))
    return layout


def _is_there(patterns: Sequence[str], names: Sequence[str]) -> bool:
    return bool(patterns) and all(x in names or ("*" in x and matching(x, names)) for x in patterns)


def _require_complete(path: Path, found: Mapping[str, Array]) -> None:
    for name, values in found.items():
        if wrong := np.flatnonzero(~np.isfinite(values.reshape(len(values), -1)).all(axis=1)).tolist():
            raise LogError(f"{path}: {name} is missing at sample {wrong[0]}; remove or repair such samples first")


def _require_radians(path: Path, layout: LogLayout, found: Mapping[str, Array]) -> None:
    """Raise LogError if angles without a stated unit are those of several turns."""
    for name, values in found.items():
        if not getattr(layout, name).unit and (most := float(np.nanmax(np.abs(values)))) > FARTHEST:
            raise LogError(
                f"{path}: {name} reaches {most:.4g} rad: state its unit, --units q=deg command=deg, or q=rad if it is in rad; "
                "angles in -100 to 100 of a calibrated range (LeRobot) have none: record with use_degrees=true"
            )


def _require_steady(path: Path, table: LogTable, t: Array) -> None:
    """Raise LogError if times begin again: several runs are in one file."""
    if (np.diff(t) > 0).all():
        return
    episodes = [name for name in EPISODES if name in table.columns and len(np.unique(table.columns[name])) > 1]
    if episodes:
        first = float(table.columns[episodes[0]][0])
        raise LogError(f"{path} holds several runs by {episodes[0]}: name one, --rows {episodes[0]}={first:g}")


def ordered(columns: ServoColumns, joints: Sequence[str], actuators: Mapping[str, str], path: Path) -> ServoColumns:
    """Columns in the order of the joints; raise LogError if the log does not have them all.

    Commands may be called by the names of actuators, each of a joint.
    """
    place = _order(columns, joints, path)
    called = [actuators.get(name, name) for name in columns.commanded]
    own = [called.index(joint) for joint in joints] if set(called) >= set(joints) else place
    beside: dict[str, Any] = {name: None if (x := getattr(columns, name)) is None else x[:, place] for name in OPTIONAL}
    q, command = columns.q[:, place], columns.command[:, own]
    return replace(columns, q=q, command=command, joints=tuple(joints), commanded=(), **beside)


def _order(columns: ServoColumns, joints: Sequence[str], path: Path) -> list[int]:
    """Column of each joint."""
    if columns.joints:
        if missing := [joint for joint in joints if joint not in columns.joints]:
            raise LogError(f"{path} names the joints {', '.join(columns.joints)}; the robot's {', '.join(missing)} is missing")
        return [columns.joints.index(joint) for joint in joints]
    if columns.q.shape[1] != len(joints):
        numbers = f"number of positions {columns.q.shape[1]}, joints of the robot {len(joints)}: {', '.join(joints)}"
        raise LogError(f"{path}: {numbers}; --lock NAME=VALUE holds those that the log does not have")
    return list(range(len(joints)))
