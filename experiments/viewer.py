"""Opening a recording in the rerun viewer."""

import subprocess
from pathlib import Path

from experiments.errors import ResultsError


def view(folder: Path) -> int:
    """Open the recording of a results folder (or a recording itself); return the viewer's exit code when it is closed.

    Raises
    ------
    ResultsError
        If there is no recording, or no viewer.
    """
    path = folder / "recording.rrd" if folder.is_dir() else folder
    if not path.is_file():
        raise ResultsError(f"there is no recording {path}: run an experiment first, with --out {folder}")
    import rerun_cli  # the viewer's binary, found beside its package

    binary = Path(str(rerun_cli.__file__)).parent / "rerun"
    try:
        return subprocess.run([binary, path, "--bind", "127.0.0.1"], check=False).returncode
    except OSError as error:
        raise ResultsError(f"cannot start the rerun viewer {binary}: {error.strerror}") from error
