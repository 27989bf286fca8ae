"""Writing arrays to a rerun recording: columns, not rows."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from experiments.errors import ResultsError
from identify import Array

NANOSECONDS = 1_000_000_000


@contextmanager
def recording_file(path: Path, name: str, blueprint: rrb.Blueprint) -> Iterator[rr.RecordingStream]:
    """Give a recording that goes to `path`, with its blueprint inside; it is complete when the block ends."""
    recording = rr.RecordingStream("idbench", recording_id=name)
    try:
        recording.save(path, default_blueprint=blueprint)
        recording.set_log_time_enabled(False)
        yield recording
        recording.flush()
    except RuntimeError as error:  # rerun's writer gives no other reason
        raise ResultsError(f"cannot write the recording {path.name}: is there space left? ({error})") from error
    finally:
        recording.disconnect()


def time_columns(t: Array, fs: float) -> list[rr.TimeColumn]:
    """Return the timelines sim_time (exact to 1 ns) and sample of the instants `t` [s]."""
    nanoseconds = np.rint(t * NANOSECONDS).astype(np.int64)
    return [
        rr.TimeColumn("sim_time", duration=nanoseconds.astype("timedelta64[ns]")),
        rr.TimeColumn("sample", sequence=np.rint(t * fs).astype(np.int64)),
    ]


def send_curves(
    recording: rr.RecordingStream,
    path: str,
    times: Sequence[rr.TimeColumn],
    values: Array,
    names: Sequence[str],
    colors: Sequence[Sequence[int]],
    widths: Sequence[float],
) -> None:
    """Send `values`, shape (time, curve), as one entity with a curve each."""
    recording.log(path, rr.SeriesLines(names=names, colors=colors, widths=widths), static=True)
    scalars = rr.Scalars.columns(scalars=np.ascontiguousarray(values).ravel())
    recording.send_columns(path, times, scalars.partition([values.shape[1]] * len(values)))
