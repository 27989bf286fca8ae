"""Opening a recording in the rerun viewer."""

import os
import subprocess
import sys
from pathlib import Path

from experiments.errors import ResultsError


def view(folder: Path) -> None:
    """Open the recording of a results folder, or a recording itself; return when the viewer is closed.

    Raises
    ------
    ResultsError
        If there is no recording, no display, or the viewer fails.
    """
    path = folder / "recording.rrd" if folder.is_dir() else folder
    if path.suffix != ".rrd" or not path.is_file():
        raise ResultsError(f"there is no recording {path}: name a results folder, such as runs/table1, or a .rrd file")
    if sys.platform == "linux" and not (os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")):
        raise ResultsError(
            f"there is no display here: copy {path} to a machine with one, or serve it to a browser with "
            f"`uv run rerun --serve-web --bind 127.0.0.1 {path}`"
        )
    import rerun_cli  # the viewer's binary lies beside its package

    binary = Path(str(rerun_cli.__file__)).parent / "rerun"
    try:
        code = subprocess.run([binary, path, "--bind", "127.0.0.1"], check=False).returncode
    except OSError as error:
        raise ResultsError(f"cannot start the rerun viewer {binary}: {error.strerror}") from error
    if code:
        raise ResultsError(f"the rerun viewer ended with code {code}")
