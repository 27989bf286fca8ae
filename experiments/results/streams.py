"""Recordings in a results folder."""

from typing import TYPE_CHECKING

from idbench.experiments.results.folder import ResultsFolder

if TYPE_CHECKING:
    from collections.abc import Sequence

    from idbench.experiments.recording.stream import Stream

    Streams = Sequence[tuple[str, Stream]]


def write_streams(streams: "Streams", folder: ResultsFolder | None) -> None:
    """Write the files of a recording into a results folder, all or none; who watches has seen them anyway.

    Raises
    ------
    ResultsError
        If they cannot be written.
    """
    try:
        if folder is not None:
            with folder.more() as hidden:
                for name, stream in streams:
                    stream.write(hidden / name)
    finally:
        for _, stream in streams:  # when everything is written: a viewer may hang
            stream.close()
