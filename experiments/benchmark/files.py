"""The files of a set: those that a row follows from, and whether an earlier row follows from the same."""

import json
import os
from functools import cache
from hashlib import file_digest, sha256
from importlib.metadata import version
from pathlib import Path
from typing import Any

from idbench import experiments, identify, sim
from idbench.experiments.benchmark.definition import FILE, Definition
from idbench.experiments.benchmark.tools import PREDICTED
from idbench.experiments.errors import ExperimentError
from idbench.experiments.requests.table import files_named
from idbench.identify.files.layout import LogLayout

PACKAGES = (identify, sim, experiments)


def require_files(folder: Path, definition: Definition) -> None:
    """Raise ExperimentError that names logs that are not there, and how to get them."""
    missing = [name for name in definition.files if not (folder / name).exists()]
    if missing:
        how = f"; get the data with: {' && '.join(definition.get.strip().splitlines())}" if definition.get else ""
        raise ExperimentError(f"{folder} has no {', '.join(missing)}{how}")


def files_of(folder: Path, definition: Definition) -> tuple[Path, ...]:
    """Return the files that a row follows from: all that the request names, and what these name; layouts beside logs."""
    logs = [folder / name for name in definition.files]
    inside = [path for log in logs if log.is_dir() for path in log.rglob("*")]
    layouts = [found for log in logs if log.is_file() and (found := LogLayout.beside(log))]
    named = [path.parent / name for layout, path in layouts for name in layout.files]
    every = {folder / FILE, *logs, *inside, *(path for _, path in layouts), *named}
    return tuple(sorted({path for path in every if path.is_file()} | {*files_named(definition.request(folder))}))


def made_of_files(folder: Path, definition: Definition, out: Path) -> dict[str, str]:
    """Return digests of all that a row follows from, by its path."""
    found = {os.path.relpath(path, folder): _digest(path) for path in files_of(folder, definition)}
    found |= {path.name: _digest(path) for path in sorted(out.glob(PREDICTED))}
    return {"idbench": version("idbench"), "code": _code(), **found}


@cache
def _code() -> str:
    """Return a digest of what makes a row: between two releases it changes, too."""
    found = sha256()
    for package in PACKAGES:
        for path in sorted(Path(package.__path__[0]).rglob("*.py")):
            found.update(path.read_bytes())
    return found.hexdigest()


def _digest(path: Path) -> str:
    with path.open("rb") as file:
        return file_digest(file, "sha256").hexdigest()


def kept_row(out: Path, made_of: dict[str, str]) -> dict[str, Any] | None:
    """Return the row of earlier results, if it follows from the same files."""
    try:
        row: dict[str, Any] = json.loads((out / "summary.json").read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError):
        return None
    return row if isinstance(row, dict) and row.get("made_of") == made_of else None
