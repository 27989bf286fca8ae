"""Opening a recording in the rerun viewer."""

import subprocess
import tempfile
from collections.abc import Sequence
from pathlib import Path

from idbench.experiments.cli.options.tools import View
from idbench.experiments.errors import ExperimentError, ResultsError
from idbench.experiments.recording.audience import LOOPBACK, require_display, viewer_binary
from idbench.experiments.recording.comparison_recording import compare
from idbench.experiments.recording.folder import BASE, files, merge
from idbench.experiments.results.page import Page
from idbench.experiments.results.writing import new_file

LATEST = Path("runs")  # Where the latest results are looked for


def view(options: View) -> None:
    """Open a recording, or write it to one file."""
    page, folders = Page(), options.folders or (_latest(),)
    if not options.folders:
        page.print(f"the latest of {LATEST}: {folders[0]}", soft_wrap=True)
    if options.save is None:
        page.close()
        _open(folders, options.tab)
        return
    if options.save.suffix != ".rrd":
        raise ResultsError(f"--save {options.save} must end with .rrd")
    own = options.save.absolute().parent in [folder.absolute() for folder in folders]
    if options.save.name.startswith("recording.") and own:
        raise ResultsError(f"--save {options.save} would be a part of the recording itself: choose another name")
    with new_file(options.save, "--save", force=options.force) as file:
        _merge(folders, options.tab, file)
    page.print(f"written to {options.save}", soft_wrap=True)
    page.close()


def _open(folders: Sequence[Path], tab: str) -> None:
    """Open recordings of results folders, or a recording itself; return when the viewer is closed.

    Raises
    ------
    ResultsError
        If there is no recording, no display, or the viewer fails.
    """
    paths = [path for folder in folders for path in _paths(folder)]
    try:
        require_display()
    except ExperimentError:
        raise ResultsError(
            f"there is no display here: serve it to a browser with `uv run rerun --serve-web --bind {LOOPBACK} "
            f"{' '.join(map(str, paths))}`, or write it to one file with --save FILE and copy that to a machine with a display"
        ) from None
    with tempfile.TemporaryDirectory(prefix="idbench-") as hidden:
        one = paths
        if len(folders) > 1 or folders[0].is_dir() or tab:
            one = [Path(hidden) / BASE]
            _merge(folders, tab, one[0])
        binary = viewer_binary()
        try:
            code = subprocess.run([binary, *one, "--bind", LOOPBACK], check=False).returncode
        except OSError as error:
            raise ResultsError(f"cannot start the rerun viewer {binary}: {error.strerror}") from error
    if code:
        raise ResultsError(f"the rerun viewer ended with code {code}")


def _merge(folders: Sequence[Path], tab: str, out: Path) -> None:
    if len(folders) > 1:
        compare(folders, tab, out)
    else:
        merge(_paths(folders[0]), tab, out)


def _latest() -> Path:
    """Return the folder of the recording that was written last."""
    found = sorted(LATEST.glob(f"*/{BASE}"), key=lambda path: path.stat().st_mtime)
    if not found:
        way_out = "name a results folder, or make one, such as `idbench run ripple`"
        raise ResultsError(f"there is no recording in {LATEST}: {way_out}")
    return found[-1].parent


def _paths(folder: Path) -> list[Path]:
    """Return the files of a recording, in the order in which a viewer should open them."""
    paths = files(folder) if folder.is_dir() else [folder]
    if not paths or any(path.suffix != ".rrd" or not path.is_file() for path in paths):
        missing = folder / BASE if folder.is_dir() else folder
        raise ResultsError(f"there is no recording {missing}: name a results folder, such as runs/table1, or a .rrd file")
    return paths
