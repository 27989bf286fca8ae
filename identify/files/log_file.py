"""Motion logs on disk: CSV or Parquet with the columns t, q1, q2, ..., tau1, tau2, ... in SI units."""

import json
import os
import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any

import numpy as np

from identify.arrays import Array
from identify.data.motion_log import MotionLog, TorqueChannel
from identify.errors import LogError

if TYPE_CHECKING:
    import pyarrow as pa

_TORQUE = b"idbench.torque"

CSV = ".csv"
"""What the name of a CSV file ends with; every other file is taken for Parquet."""


@dataclass(frozen=True, eq=False)
class LogColumns:
    """The columns of a file, as they are.

    Parameters
    ----------
    t : Array, shape (time,)
        [s].
    q, tau : Array, shape (time, joint)
        [rad], [N m].
    torque : TorqueChannel or None
        What the file says of its torque.
    joints : tuple of str
        Names of the joints, where the columns have them.
    """

    t: Array
    q: Array
    tau: Array
    torque: TorqueChannel | None
    joints: tuple[str, ...] = ()

    def ordered(self, joints: Sequence[str]) -> "LogColumns":
        """Return the columns in the order of `joints`, where they have names.

        Raises
        ------
        LogError
            If there are others, or not as many.
        """
        if self.joints and set(self.joints) != set(joints):
            missing, over = ", ".join(set(joints) - set(self.joints)), ", ".join(set(self.joints) - set(joints))
            wrong = "; ".join(text for text in (missing and f"missing: {missing}", over and f"not the robot's: {over}") if text)
            raise LogError(f"the log names the joints {', '.join(self.joints)}, the robot {', '.join(joints)}: {wrong}")
        if self.q.shape[1] != len(joints):
            raise LogError(f"the log has {self.q.shape[1]} joints, the robot {len(joints)}: {', '.join(joints)}")
        if not self.joints:
            return self
        place = [self.joints.index(joint) for joint in joints]
        return replace(self, q=self.q[:, place], tau=self.tau[:, place], joints=tuple(joints))


def write_log(log: MotionLog, path: Path, joints: Sequence[str] = ()) -> None:
    """Write one run to a CSV or Parquet file; the torque channel goes into the metadata of Parquet.

    CSV has no place for it; its torques are in N m, gain included. Columns are named after the `joints`, or numbered.

    Raises
    ------
    LogError
        If the log holds several runs.
    OSError
        If the file cannot be written.
    """
    if log.q.ndim != 2:
        raise LogError(f"a file holds one run, the log has shape {log.q.shape}: write each run by itself")
    ends = [f"_{joint}" for joint in joints] or [str(j + 1) for j in range(log.n)]
    pa = _arrow()
    from pyarrow import csv, parquet

    columns = {"t": log.t}
    columns |= {f"q{end}": x for end, x in zip(ends, log.q.T, strict=True)}
    in_newton_metres = path.suffix.lower() == CSV
    tau = log.tau * np.asarray(log.torque.gain) if in_newton_metres else log.tau
    columns |= {f"tau{end}": x for end, x in zip(ends, tau.T, strict=True)}
    table = pa.table({name: pa.array(values) for name, values in columns.items()})
    if in_newton_metres:
        csv.write_csv(table, path)
        return
    torque = {"meaning": log.torque.meaning, "delay": log.torque.delay, "gain": log.torque.gain}
    parquet.write_table(table.replace_schema_metadata({_TORQUE: json.dumps(torque).encode()}), path)


def read_log(path: Path, torque: TorqueChannel | None = None, joints: Sequence[str] = ()) -> MotionLog:
    """Read a log from a CSV or Parquet file.

    Parameters
    ----------
    path : Path
        The file; CSV if its name ends with .csv.
    torque : TorqueChannel, optional
        What its torque means; by default what the file says of it.
    joints : sequence of str, optional
        Names of the joints, in the order of the log; needed where the columns have names.

    Raises
    ------
    LogError
        If the file cannot be read, lacks a column, does not say what its torque means and `torque` does not either, or
        holds values that make no log.
    """
    found = read_columns(path)
    if found.joints and not joints:
        raise LogError(f"{path} names its joints, {', '.join(found.joints)}: say their order with joints=(...)")
    found = found.ordered(joints) if joints else found
    channel = torque or found.torque
    if channel is None:
        raise LogError(
            f"{path} does not say what its torque means: instantaneous, held or averaged, and with what "
            "delay; say it with torque=TorqueChannel(...)"
        )
    return MotionLog.at_times(found.t, found.q, found.tau, channel)


def read_columns(path: Path) -> LogColumns:
    """Read t, q and tau from a file, whatever their times; raise LogError as `read_log`.

    Joints may have names instead of numbers: q_elbow, tau_elbow. Columns qd1, qd2, ... are allowed and not used: velocities
    come from the positions, by the chain's own differences.
    """
    table, names = _table(Path(path))
    _require_header(path, names)
    if not table.num_rows:
        raise LogError(f"{path} holds no samples")
    stated, table = (table.schema.metadata or {}).get(_TORQUE), table.rename_columns(names)
    n = sum(bool(re.fullmatch(r"q\d+", name)) for name in names)
    joints = () if n else tuple(name.removeprefix("q_") for name in names if name.startswith("q_"))
    n = max(n, 1)
    ends = [f"_{joint}" for joint in joints] or [str(j + 1) for j in range(n)]
    needed = ["t", *(f"q{end}" for end in ends), *(f"tau{end}" for end in ends)]
    present = [name for name in names if re.fullmatch(r"t|(q|tau)_.+" if joints else r"t|(q|tau)\d+", name)]
    if wrong := set(needed) ^ set(present) | {name for name in present if present.count(name) > 1}:
        raise LogError(
            f"{path} must have a header with the columns {', '.join(needed)}; missing, left over or twice: "
            f"{', '.join(sorted(wrong))}"
        )
    numbers = {name: _numbers(path, table, name) for name in needed}
    q, tau = (np.stack([numbers[f"{letter}{end}"] for end in ends], axis=-1) for letter in ("q", "tau"))
    return LogColumns(numbers["t"], q, tau, None if stated is None else _channel(path, stated), joints)


def _arrow() -> ModuleType:
    """Return pyarrow, which this file alone needs; raise LogError if it is not installed."""
    try:
        import pyarrow
    except ImportError as error:
        raise LogError(
            "files of logs are read and written with pyarrow: pip install pyarrow; or make a MotionLog of your own arrays"
        ) from error
    return pyarrow


def _table(path: Path) -> "tuple[pa.Table, list[str]]":
    """Return a file's columns, and their names without quotes and spaces."""
    pa = _arrow()
    from pyarrow import csv, parquet

    is_csv = path.suffix.lower() == CSV
    try:
        with path.open("rb") as file:
            table = csv.read_csv(file, **_dialect(path)) if is_csv else _numeric_columns(path, parquet.ParquetFile(file))
        return table, [name.strip(' "') for name in table.column_names]
    except OSError as error:
        raise LogError(f"cannot read the log {path}: {error.strerror or error}") from error
    except UnicodeDecodeError as error:
        raise LogError(f"cannot read the log {path}: byte {error.start} of its header is no UTF-8; save it as UTF-8") from error
    except pa.ArrowException as error:
        kind = "CSV" if is_csv else "Parquet (a CSV file's name must end with .csv)"
        raise LogError(f"cannot read the log {path} as {kind}: {str(error).splitlines()[0]}") from error


def _numeric_columns(path: Path, file: Any) -> "pa.Table":
    """Return the columns of a Parquet file that a log has; raise LogError before anything is read that no memory holds.

    A file of some kilobytes may hold a column of terabytes, all values being the same.
    """
    types, wanted = _arrow().types, list[str]()
    for field in file.schema_arrow:
        name, kind = field.name.strip(' "'), field.type
        if types.is_floating(kind) or types.is_integer(kind) or types.is_null(kind):
            wanted += [field.name] if re.fullmatch(r"t|(q|tau)(\d+|_.+)", name) else []
        elif re.fullmatch(r"t|(q|tau)\d+", name):
            raise LogError(f"{path}: column {name} holds {kind}, not numbers")
    rows = file.metadata.num_rows
    size, room = 8e-9 * rows * len(wanted), _memory()
    if size > room:
        what = f"{rows:.3g} samples of {len(wanted)} columns, {size:.3g} GB"
        raise LogError(f"{path} says that it holds {what}; this machine has {room:.3g} GB: cut the log")
    return file.read(columns=wanted)


def _memory() -> float:
    """Return the memory of this machine [GB]; infinity where it does not say."""
    try:
        return 1e-9 * os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    except (AttributeError, ValueError, OSError):
        return float("inf")


def _dialect(path: Path) -> "dict[str, Any]":
    """Return how a CSV file separates columns and decimals, as its first lines show."""
    from pyarrow import csv

    with path.open("rb") as file:
        header, first = file.readline(), file.readline()
    separator = next((mark for mark in (b",", b";", b"\t") if mark in header), b",")
    decimal = "," if separator != b"," and b"," in first and b"." not in first else "."
    parse, convert = csv.ParseOptions(delimiter=separator.decode()), csv.ConvertOptions(decimal_point=decimal)
    return {"parse_options": parse, "convert_options": convert}


def _require_header(path: Path, names: Sequence[str]) -> None:
    """Raise LogError if the first line of a file is one of numbers."""
    if all(re.fullmatch(r"[-+.\deE]*\d[-+.\deE]*", name) for name in names):
        joints = max(1, (len(names) - 1) // 2)
        line = ",".join(["t", *(f"{x}{j + 1}" for x in ("q", "tau") for j in range(joints))])
        raise LogError(f"{path} has no header, its first line is numbers: put a line of names before it, such as {line}")


def _numbers(path: Path, table: "pa.Table", name: str) -> Array:
    """Return a column as numbers; an empty cell is NaN, which no log may have."""
    pa, column = _arrow(), table[name]
    if not (pa.types.is_floating(column.type) or pa.types.is_integer(column.type) or pa.types.is_null(column.type)):
        raise LogError(f"{path}: column {name} holds {column.type}, not numbers{_culprit(column)}")
    values: Array = column.cast(pa.float64()).to_numpy()
    return values


def _culprit(column: "pa.ChunkedArray[Any]") -> str:
    """Return the first cell of a column that is no number, and its line."""
    for k, cell in enumerate(column.to_pylist()):
        try:
            float(cell if cell is not None else "nan")
        except (TypeError, ValueError):
            return f": {cell!r:.40} in line {k + 2}"
    return ""


def _channel(path: Path, stated: bytes) -> TorqueChannel:
    try:
        known = json.loads(stated)
        return TorqueChannel(known["meaning"], known["delay"], known["gain"])
    except (ValueError, KeyError, TypeError) as error:
        raise LogError(
            f"{path} states {stated.decode(errors='replace')!r} of its torque, which makes no torque channel"
        ) from error
