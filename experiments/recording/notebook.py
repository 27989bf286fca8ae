"""Recordings in a notebook: rerun's viewer below a cell."""

from pathlib import Path
from typing import TYPE_CHECKING

import rerun as rr
from rerun.chunk import RrdReader

from idbench.experiments.errors import ResultsError
from idbench.experiments.recording.folder import files, known
from idbench.experiments.recording.layouts import tabs
from idbench.experiments.recording.stream import APPLICATION

if TYPE_CHECKING:
    from rerun.notebook import Viewer


def notebook_viewer(results: Path, tab: str = "", width: int = 1200, height: int = 700) -> "Viewer":
    """Return the viewer of a results folder's recording; as the last line of a cell it is shown.

    Parameters
    ----------
    results : Path
        Results folder, such as runs/ripple.
    tab : str
        What is in front; the first by default.
    width, height : int
        Size [pixels].

    Raises
    ------
    ResultsError
        If there is no recording, it has no such tab, or rerun's notebook viewer is not installed.
    """
    if not (paths := files(results)):
        raise ResultsError(f"there is no recording in {results}: name a results folder, such as runs/table1")
    name, entities = known(paths)
    layout, recording = tabs(entities, tab), rr.RecordingStream(APPLICATION, recording_id=name)
    try:
        from rerun.notebook import Viewer

        viewer = Viewer(width=width, height=height, recording=recording, blueprint=layout)
    except ImportError as error:
        raise ResultsError('rerun\'s notebook viewer is missing: uv pip install "rerun-sdk[notebook]"') from error
    for path in reversed(paths):
        reader = RrdReader(path)
        for entry in reader.recordings():
            rr.send_chunks(reader.stream(store=entry), recording=recording)
    return viewer
