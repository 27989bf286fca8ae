"""The recording of a results folder: a base and its layers, each a file of its own."""

import warnings
from collections.abc import Sequence
from pathlib import Path

from rerun.chunk import RrdReader

from idbench.experiments.errors import ResultsError
from idbench.experiments.recording.layouts import tabs
from idbench.experiments.recording.stream import Stream
from idbench.experiments.results.folder import RECORDING

BASE = RECORDING
INNER = "recording.inner.rrd"


def layer_file(label: str) -> str:
    """Return the name of the file of an identification's layer."""
    return f"recording.{label}.rrd"


def files(folder: Path) -> list[Path]:
    """Return the recording of a folder: its layers, newest first, and then the base.

    A viewer lays out what it opens first, and the newest layer knows of all the others.
    """
    layers = sorted(folder.glob("recording.*.rrd"), key=lambda path: (path.name != INNER, path.stat().st_mtime), reverse=True)
    base = folder / BASE
    return [*layers, base] if base.is_file() else layers


def known(paths: Sequence[Path]) -> tuple[str, set[str]]:
    """Return the recording id and the entities of files of one recording.

    Raises
    ------
    ResultsError
        If one cannot be read, or they are of different recordings.
    """
    ids, entities = set[str](), set[str]()
    for path in paths:
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")  # what is wrong we say ourselves, in one line
                reader = RrdReader(path)
                ids |= {entry.recording_id for entry in reader.recordings()}
                columns = reader.store().schema().component_columns()
        except (RuntimeError, ValueError, OSError) as error:
            raise ResultsError(f"cannot read the recording {path}: {' '.join(str(error).split())}") from error
        entities |= {column.entity_path.strip("/") for column in columns}
    if len(ids) != 1:
        raise ResultsError(f"{', '.join(map(str, paths))} hold {len(ids)} recordings, not one: record the run anew")
    return ids.pop(), entities


def merge(paths: Sequence[Path], tab: str, out: Path) -> None:
    """Write files of one recording as one file that opens with the layout `tab`.

    Raises
    ------
    ResultsError
        If a file cannot be read or written, or the recording has no such layout.
    """
    name, entities = known(paths)
    stream = Stream(name)
    stream.open_with(tabs(entities, tab))
    for path in reversed(paths):
        stream.copy(path)
    stream.write(out)


def rearranged(paths: Sequence[Path], fresh: Stream) -> list[tuple[str, Stream]]:
    """Return layers anew, by the name of their file, so that they, too, lay out what `fresh` adds to their recording."""
    (name, entities), streams = known(paths), []
    for path in paths:
        if path.name not in (BASE, INNER):
            stream = Stream(name, layer=True)
            stream.copy(path)
            stream.arrange(tabs(entities | fresh.paths))
            streams.append((path.name, stream))
    return streams
