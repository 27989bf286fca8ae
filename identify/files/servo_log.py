"""Logs of servos on disk: t, q, command, and where they were logged whether torque is on and the supply voltage."""

import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any, final

import numpy as np

from idbench.identify.arrays import Array
from idbench.identify.errors import IdentificationError, LogError, SettingError
from idbench.identify.files.formats import read_table
from idbench.identify.files.layout import matching
from idbench.identify.files.table import LogTable, factor
from idbench.identify.plugins import did_you_mean
from idbench.identify.servo.closed_loop import PUBLISHED, Servo

GAIN_UNITS = {"1/rad": 1.0, "1/deg": 180 / np.pi, "1/count": 0.0}
"""Units of a gain, duty per unit of kp and of error, and what makes 1/rad of it; counts depend on the encoder."""

KEYS = ("model", "gain_unit", *(field.name for field in fields(Servo)))
"""What a servo may state."""

ROBOT = "robot"
"""What a log may state beside: the robot, links and load, that it is of."""


@final
@dataclass(frozen=True)
class ServoFile:
    """What is known of the servos of a robot."""

    stated: Mapping[str, Any]
    """What holds for all joints."""
    joints: Mapping[str, Mapping[str, Any]]
    """What holds for one joint alone, by its name."""
    logs: Mapping[str, Mapping[str, Any]]
    """What holds for some logs alone, by the name of the file or a pattern (* for any letters): kp, or the robot that carried
    another load."""
    folder: Path = Path()
    """Where the file is: robots of logs are named from there."""

    @classmethod
    def read(cls, path: Path) -> "ServoFile":
        r"""Return what a file states; raise SettingError that names what is unknown or wrong in it.

        Examples
        --------
        >>> import tempfile
        >>> from pathlib import Path
        >>> path = Path(tempfile.mkdtemp()) / "servo.toml"
        >>> _ = path.write_text('model = "STS3215"\nsupply = 12.0\nkp = 16\n')
        >>> ServoFile.read(path).servo("elbow", "log.csv").duty_limit
        0.97
        """
        try:
            stated = tomllib.loads(path.read_text(encoding="utf-8"))
            joints, logs = stated.pop("joints", {}), stated.pop("logs", {})
            made = cls(stated, joints, logs, path.absolute().parent)
            for part in (stated, *joints.values(), *({k: x for k, x in each.items() if k != ROBOT} for each in logs.values())):
                _require_known(part)
            _require_names(logs)
            made.servo("", "")
        except OSError as error:
            raise SettingError(f"cannot read {path}: {error.strerror or error}") from error
        except (ValueError, TypeError, AttributeError, RecursionError) as error:  # ours are ValueErrors, too
            raise SettingError(f"{path}: {error}") from error
        return made

    def servo(self, joint: str, log: str) -> Servo:
        """Return the servo of a joint in a log."""
        stated = {**self.stated, **self.joints.get(joint, {}), **self._of_log(log)}
        stated.pop(ROBOT, None)
        model, unit = stated.pop("model", None), stated.pop("gain_unit", "1/rad")
        if model is not None:
            if model not in PUBLISHED:
                raise SettingError(f"model = {model!r} is unknown{did_you_mean(str(model), PUBLISHED)}; {_published()}")
            stated = {**dict(zip(("gain", "duty_limit", "counts"), PUBLISHED[model], strict=True)), **stated}
        if "gain" not in stated:
            raise SettingError(f"gain is missing: the duty per unit of kp and rad, or a model that has it; {_published()}")
        if unit not in GAIN_UNITS:
            raise SettingError(f"gain_unit = {unit!r} is unknown; known: {', '.join(GAIN_UNITS)}")
        counts = stated.get("counts", Servo.counts)
        stated["gain"] *= GAIN_UNITS[unit] or counts / (2 * np.pi)
        return Servo(**stated)

    def robot(self, log: str) -> str | None:
        """Return the robot that a log is of, if that is stated: its name, or the path of its file."""
        name = self._of_log(log).get(ROBOT)
        return str(self.folder / name) if name and (self.folder / name).exists() else name

    def _of_log(self, log: str) -> dict[str, Any]:
        """Return what is stated of a log; later patterns go before earlier ones."""
        return {key: x for pattern, part in self.logs.items() if fnmatchcase(log, pattern) for key, x in part.items()}


def _require_names(logs: Mapping[str, Mapping[str, Any]]) -> None:
    for pattern, part in logs.items():
        if ROBOT in part and not isinstance(part[ROBOT], str):
            raise IdentificationError(f'[logs."{pattern}"]: robot = {part[ROBOT]!r} must be the name of a robot or of its file')


def _require_known(part: Mapping[str, Any]) -> None:
    for key, value in part.items():
        if key not in KEYS:
            raise IdentificationError(
                f"key {key!r} is unknown{did_you_mean(key, KEYS)}; known: {', '.join(KEYS)}, joints, logs"
            )
        if key not in ("model", "gain_unit") and (isinstance(value, bool) or not isinstance(value, int | float)):
            raise IdentificationError(f"{key} = {value!r} must be a number")


def _published() -> str:
    return f"published: {', '.join(PUBLISHED)}"


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
    """Positions [rad], shape (time, joint)."""
    command: Array
    """Commanded positions [rad], shape (time, joint)."""
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
