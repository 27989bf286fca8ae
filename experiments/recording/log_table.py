"""Logs that are in recordings of rerun: the scalars of their entities, ours and others'."""

from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from idbench.identify import Array, LogError
from idbench.identify.files.formats import FORMATS
from idbench.identify.files.table import LogTable

SCALARS = "Scalars:scalars"
OURS = ("q/measured", "torque/log")  # What a recording of idbench shows of a log
WRITING = ("log_time", "log_tick")  # Timelines of when something was written, not of when it was


def read_recording(path: Path) -> LogTable:
    """Return the time [s] and the scalars of a recording, an entity a column, on the timeline that most of them have.

    Instants of an entity alone are empty in others.

    Raises
    ------
    LogError
        If it cannot be read, or has no scalars in time.
    """
    from rerun.chunk import RrdReader

    try:
        batches = [(str(chunk.entity_path), chunk.to_record_batch()) for chunk in RrdReader(path).stream().to_chunks()]
    except Exception as error:  # rerun raises what its parsers do
        raise LogError(f"cannot read the recording {path}: {str(error).splitlines()[0]}") from error
    batches = [(name, batch) for name, batch in batches if SCALARS in batch.schema.names]
    clocks = Counter(
        field.name
        for _, batch in batches
        for field in batch.schema
        if (field.metadata or {}).get(b"rerun:kind") == b"index" and str(field.type).startswith(("duration", "timestamp"))
    )
    clock = max((name for name in clocks if name not in WRITING), key=clocks.__getitem__, default="log_time")
    found: dict[str, list[tuple[npt.NDArray[np.int64], Array]]] = {}
    for name, batch in batches:
        if clock not in batch.schema.names:
            continue
        ns = np.asarray(batch.column(clock).to_numpy(zero_copy_only=False)).astype(np.int64)
        rows: list[Any] = batch.column(SCALARS).to_pylist()
        if len({len(row) for row in rows}) == 1:
            found.setdefault(name.strip("/"), []).append((ns, np.array(rows, dtype=np.float64)))
    if not found:
        raise LogError(f"{path} is a recording without scalars in time: record positions and torques, or name the log itself")
    if set(OURS) <= set(found):  # beside these, our recordings have what was simulated, and what models make of it
        found = {name: found[name] for name in OURS}
    joined = {name: [np.concatenate(x) for x in zip(*parts, strict=True)] for name, parts in found.items()}
    every = np.unique(np.concatenate([ns for ns, _ in joined.values()]))
    columns = {"t": 1e-9 * (every - every[0]).astype(np.float64)}
    for name, (ns, values) in joined.items():
        whole = np.full((len(every), values.shape[1]), np.nan)
        whole[np.searchsorted(every, ns)] = values
        columns[name] = whole if whole.shape[1] > 1 else whole[:, 0]
    return LogTable(columns)


FORMATS[".rrd"] = read_recording  # here, since `identify` knows no viewer
