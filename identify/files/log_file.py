"""Motion logs on disk: CSV or Parquet with the columns t, q1, q2, ..., tau1, tau2, ... in SI units."""

import json
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from idbench.identify.data.motion_log import MotionLog, TorqueChannel
from idbench.identify.errors import LogError
from idbench.identify.files.arrow import TORQUE, arrow
from idbench.identify.files.reading import read_columns

CSV = ".csv"  # What the name of a CSV file ends with
WRITTEN = (CSV, ".parquet")  # What names of files end with that idbench writes


COLUMNS = ("temperature", "command", "on")  # Conditions that have columns


def write_log(log: MotionLog, path: Path | str, joints: Sequence[str] = ()) -> None:
    """Write one run to a CSV or Parquet file; the torque channel goes into the metadata of Parquet.

    CSV has no place for it; its torques are in N m, gain included. Columns are named after the `joints`, or numbered.

    Raises
    ------
    LogError
        If the log holds several runs.
    OSError
        If the file cannot be written.
    """
    if not isinstance(log, MotionLog):
        raise LogError(f"write_log: {log!r:.60} is no MotionLog, such as read_log returns")
    path = Path(path)
    if path.suffix.lower() not in WRITTEN:
        raise LogError(f"{path}: the name of a log that is written must end with {' or '.join(WRITTEN)}")
    if log.q.ndim != 2:
        raise LogError(f"a file holds one run, the log has shape {log.q.shape}: write each run by itself")
    ends = [f"_{joint}" for joint in joints] or [str(j + 1) for j in range(log.n)]
    pa = arrow()
    from pyarrow import csv, parquet

    columns = {"t": log.t}
    columns |= {f"q{end}": x for end, x in zip(ends, log.q.T, strict=True)}
    in_newton_metres = path.suffix.lower() == CSV
    tau = log.tau * np.asarray(log.torque.gain) if in_newton_metres else log.tau
    columns |= {f"tau{end}": x for end, x in zip(ends, tau.T, strict=True)}
    for name in COLUMNS:
        if (values := log.conditions.get(name)) is not None:
            columns |= {f"{name}{end}": x for end, x in zip(ends, np.broadcast_to(values, log.q.shape).T, strict=True)}
    table = pa.table({name: pa.array(values) for name, values in columns.items()})
    if in_newton_metres:
        with path.open("wb") as file:  # not by its name, which pyarrow takes in UTF-8 alone
            csv.write_csv(table, file)
        return
    torque = {"meaning": log.torque.meaning, "delay": log.torque.delay, "gain": log.torque.gain}
    torque |= {name: x for name in ("period", "delay_sigma", "lags") if (x := getattr(log.torque, name))}
    with path.open("wb") as file:
        parquet.write_table(table.replace_schema_metadata({TORQUE: json.dumps(torque).encode()}), file)


def read_log(path: Path | str, torque: TorqueChannel | None = None, joints: Sequence[str] = ()) -> MotionLog:
    """Read a log from a file of any kind that `read_columns` knows.

    Parameters
    ----------
    path : Path
        The file.
    torque : TorqueChannel, optional
        What its torque means; by default what the file says of it.
    joints : sequence of str, optional
        Names of the joints, in the order of the log; needed where the columns have names.

    Raises
    ------
    LogError
        If the file cannot be read, lacks a column, does not say what its torque means and `torque` does not either, or
        holds values that make no log.

    Examples
    --------
    >>> import tempfile
    >>> import numpy as np
    >>> from idbench.identify import MotionLog, TorqueChannel, read_log, write_log
    >>> log = MotionLog(100.0, np.zeros((50, 2)), np.zeros((50, 2)), TorqueChannel("held", delay=0.002))
    >>> path = tempfile.mkdtemp() + "/log.parquet"
    >>> write_log(log, path)
    >>> read_log(path).torque
    TorqueChannel(meaning='held', delay=0.002, gain=1.0)
    """
    path = Path(path)
    found = read_columns(path)
    if found.joints and not joints:
        raise LogError(f"{path} names its joints, {', '.join(found.joints)}: say their order with joints=(...)")
    found = found.ordered(joints) if joints else found
    if found.t_tau is not None:
        raise LogError(f"{path} has torques at times of their own: idbench.read_log(..., resample=True) puts them on one clock")
    if (channel := torque or found.torque) is None:
        lacks = "does not say what its torque means: instantaneous, held or averaged, and with what delay"
        raise LogError(f"{path} {lacks}; say it with torque=TorqueChannel(...)")
    return MotionLog.at_times(found.t, found.q, found.tau, channel, found.conditions, found.missing)
