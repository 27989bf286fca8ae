"""Motion logs on disk: Parquet with the columns t, q1, q2, ..., tau1, tau2, ... in SI units."""

import json
import re
from pathlib import Path

import numpy as np
import pyarrow as pa
from pyarrow import parquet

from identify.arrays import Array
from identify.errors import LogError
from identify.motion_log import MotionLog, TorqueChannel

_TORQUE = b"idbench.torque"


def write_log(log: MotionLog, path: Path) -> None:
    """Write one run to a Parquet file; the torque channel goes into its metadata.

    Raises
    ------
    LogError
        If the log holds several runs.
    OSError
        If the file cannot be written.
    """
    if log.q.ndim != 2:
        raise LogError(f"a file holds one run, the log has shape {log.q.shape}: write each run by itself")
    joints = range(log.n)
    columns = {"t": log.t}
    columns |= {f"q{j + 1}": log.q[:, j] for j in joints}
    columns |= {f"tau{j + 1}": log.tau[:, j] for j in joints}
    torque = {"meaning": log.torque.meaning, "delay": log.torque.delay, "gain": log.torque.gain}
    table = pa.table({name: pa.array(values) for name, values in columns.items()})
    parquet.write_table(table.replace_schema_metadata({_TORQUE: json.dumps(torque).encode()}), path)


def read_log(path: Path, torque: TorqueChannel | None = None) -> MotionLog:
    """Read a log from a Parquet file.

    Parameters
    ----------
    path : Path
        The file.
    torque : TorqueChannel, optional
        What its torque means; by default what the file says of it.

    Raises
    ------
    LogError
        If the file cannot be read, lacks a column, does not say what its torque means and `torque` does not either, or
        holds values that make no log.
    """
    try:
        with Path(path).open("rb") as file:
            table = parquet.read_table(file)
    except OSError as error:
        raise LogError(f"cannot read the log {path}: {error.strerror or error}") from error
    except pa.ArrowException as error:
        raise LogError(f"cannot read the log {path} as Parquet: {str(error).splitlines()[0]}") from error
    names = table.column_names
    n = max(sum(name.startswith("q") and name[1:].isdigit() for name in names), 1)
    needed = ["t", *(f"q{j + 1}" for j in range(n)), *(f"tau{j + 1}" for j in range(n))]
    if wrong := set(needed) ^ {name for name in names if re.fullmatch(r"t|(q|tau)\d+", name)}:
        raise LogError(f"{path} must have the columns {', '.join(needed)}; missing or left over: {', '.join(sorted(wrong))}")
    said = (table.schema.metadata or {}).get(_TORQUE)
    if torque is None and said is None:
        raise LogError(
            f"{path} does not say what its torque means: instantaneous, held or averaged, and with what "
            "delay; say it with torque=TorqueChannel(...)"
        )
    channel = torque or _channel(path, said or b"")
    q, tau = _columns(table, "q", n), _columns(table, "tau", n)
    return MotionLog.at_times(table["t"].to_numpy(), q, tau, channel)


def _columns(table: pa.Table, letter: str, n: int) -> Array:
    return np.stack([table[f"{letter}{j + 1}"].to_numpy() for j in range(n)], axis=-1)


def _channel(path: Path, said: bytes) -> TorqueChannel:
    try:
        known = json.loads(said)
        return TorqueChannel(known["meaning"], known["delay"], known["gain"])
    except (ValueError, KeyError, TypeError) as error:
        raise LogError(f"{path} says of its torque {said.decode(errors='replace')!r}, which makes no torque channel") from error
