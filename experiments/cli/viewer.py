"""Opening a recording in the rerun viewer."""

import subprocess
import tempfile
from pathlib import Path

from experiments.cli.looking import View
from experiments.cli.page import new_page, show
from experiments.errors import ExperimentError, ResultsError
from experiments.identification.results import beside
from experiments.recording.folder import BASE, files, merge
from experiments.recording.viewers import LOOPBACK, require_display, viewer_binary


def view(asked: View) -> None:
    """Open a recording, or write it to one file."""
    if asked.save is None:
        open_viewer(asked.folder, asked.tab)
        return
    page = new_page()
    save(asked.folder, asked.tab, asked.save)
    page.print(f"written to {asked.save}", soft_wrap=True)
    show(page)


def open_viewer(folder: Path, tab: str = "") -> None:
    """Open the recording of a results folder, or a recording itself; return when the viewer is closed.

    Raises
    ------
    ResultsError
        If there is no recording, no display, or the viewer fails.
    """
    paths = _paths(folder)
    try:
        require_display()
    except ExperimentError:
        raise ResultsError(
            f"there is no display here: serve it to a browser with `uv run rerun --serve-web --bind {LOOPBACK} "
            f"{' '.join(map(str, paths))}`, or write it to one file with --save FILE and copy that to a machine with a display"
        ) from None
    with tempfile.TemporaryDirectory(prefix="idbench-") as hidden:
        one = paths
        if folder.is_dir() or tab:
            one = [Path(hidden) / BASE]
            merge(paths, tab, one[0])
        _open(one)


def save(folder: Path, tab: str, out: Path) -> None:
    """Write the recording of a results folder and its layers as one file; raise ResultsError if that fails."""
    if out.suffix != ".rrd":
        raise ResultsError(f"--save {out} must end with .rrd")
    if out.name.startswith("recording.") and out.absolute().parent == folder.absolute():
        raise ResultsError(f"--save {out} would be a part of the recording itself: choose another name")
    paths = _paths(folder)
    with beside(out.parent) as hidden:
        merge(paths, tab, hidden / out.name)


def _paths(folder: Path) -> list[Path]:
    """Return the files of a recording, in the order in which a viewer should open them."""
    paths = files(folder) if folder.is_dir() else [folder]
    if not paths or any(path.suffix != ".rrd" or not path.is_file() for path in paths):
        missing = folder / BASE if folder.is_dir() else folder
        raise ResultsError(f"there is no recording {missing}: name a results folder, such as runs/table1, or a .rrd file")
    return paths


def _open(paths: list[Path]) -> None:
    binary = viewer_binary()
    try:
        code = subprocess.run([binary, *paths, "--bind", LOOPBACK], check=False).returncode
    except OSError as error:
        raise ResultsError(f"cannot start the rerun viewer {binary}: {error.strerror}") from error
    if code:
        raise ResultsError(f"the rerun viewer ended with code {code}")
