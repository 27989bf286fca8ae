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
WRITING = ("log_time", "log_tick")  # Timelines of when something was written, not of when it was


def read_recording(path: Path) -> LogTable:
    """Return the time [s] and the scalars of a recording, an entity a column, on the timeline that most of them have.

    Those at other instants than most are left out.

    Raises
    ------
    LogError
        If it cannot be read, or has no scalars in time.
    """
    from rerun.chunk import RrdReader

    from idbench.experiments.recording.motion_layer import LOGGED

    try:
        stores = (reader := RrdReader(path)).recordings()
        chunks = [chunk for store in stores[:1] for chunk in reader.stream(store=store).to_chunks()]
        batches = [(str(chunk.entity_path), chunk.to_record_batch()) for chunk in chunks]
    except Exception as error:  # rerun raises what its parsers do
        raise LogError(f"cannot read the recording {path}: {str(error).splitlines()[0]}") from error
    if len(stores) > 1:
        raise LogError(f"{path} holds {len(stores)} recordings: split it, a recording a file")
    batches = [(name, batch) for name, batch in batches if SCALARS in batch.schema.names]
    clocks = Counter(
        field.name
        for _, batch in batches
        for field in batch.schema
        if (field.metadata or {}).get(b"rerun:kind") == b"index" and str(field.type).startswith(("duration", "timestamp"))
    )
    clock = max((name for name in clocks if name not in WRITING), key=clocks.__getitem__, default="")
    if batches and not clock:
        raise LogError(f"{path} has no timeline of times, such as set_time(..., duration=...) makes: record with one")
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
    if set(found) >= LOGGED:  # beside these, our recordings have what was simulated, and what models make of it
        found = {name: found[name] for name in LOGGED}
    joined = {name: [np.concatenate(x) for x in zip(*parts, strict=True)] for name, parts in found.items()}
    common = Counter(ns.tobytes() for ns, _ in joined.values()).most_common(1)[0][0]
    every = np.frombuffer(common, dtype=np.int64)
    columns = {"t": 1e-9 * (every - every[0]).astype(np.float64)}
    for name, (ns, values) in joined.items():
        if ns.tobytes() == common:
            columns[name] = values if values.shape[1] > 1 else values[:, 0]
    others = [name for name in joined if name not in columns]
    said = f"scalars at other instants are left out: {', '.join(others)}" if others else ""
    return LogTable(columns, words=dict.fromkeys(others, "scalars at other instants than the rest"), said=said)


FORMATS[".rrd"] = read_recording  # here, since `identify` knows no viewer
