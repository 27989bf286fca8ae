"""The one way to a file: written whole or not at all, and never in the place of what somebody else wrote."""

import hashlib
import json
import os
import socket
import tempfile
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from filecmp import cmp
from importlib.metadata import version
from math import isfinite
from pathlib import Path
from shutil import rmtree
from typing import Any, Self

import numpy as np

from idbench.experiments.errors import ExperimentError, ResultsError, shortened
from idbench.identify import Estimate

try:
    import fcntl
except ImportError:  # not on Windows, where two processes in one folder are noticed at the exchange of files alone
    fcntl = None  # type: ignore[assignment]


@contextmanager
def locked(folder: Path, busy: ExperimentError) -> Iterator[None]:
    """Hold a folder against other processes; raise `busy` if one of them holds it."""
    if fcntl is None:
        yield
        return
    try:
        held = os.open(folder, os.O_RDONLY)
    except OSError as error:
        raise ResultsError(f"cannot hold {folder}: {error.strerror}; choose another --out") from error
    try:
        with suppress(OSError):  # a file system without locks: the exchange of files looks once more
            try:
                fcntl.flock(held, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                raise busy from None
        yield
    finally:
        os.close(held)


SCHEMA = 1  # Of summaries; rises when a key changes its meaning or goes


def write_summary(path: Path, summary: dict[str, Any]) -> None:
    """Write `summary` as JSON that follows summary.schema.json, with the versions of the schema and of idbench."""
    versions = {"schema": SCHEMA, "version": version("idbench")}
    path.write_text(json.dumps(versions | summary, indent=2, allow_nan=False) + "\n", encoding="utf-8")


def summarize(estimate: Estimate, truth: list[float] | None) -> dict[str, Any]:
    """Return one model's entry of a summary: estimate, error if known, standard errors, Cond(W), rows, residual."""
    each = zip(estimate.names, estimate.X, estimate.standard_errors, estimate.problem.basis.units, strict=True)
    return {
        "parameters": {name: {"value": finite(x), "sigma": finite(s), "unit": unit} for name, x, s, unit in each},
        "estimate": estimate.X.tolist(),
        "relative_error_percent": None if truth is None else [finite(x) for x in estimate.relative_error_percent(truth)],
        "sigma": [finite(x) for x in estimate.standard_errors],
        "sigma_noise": [finite(x) for x in estimate.noise_sigma],
        "paper_sigma": [finite(x) for x in estimate.own_sigma],
        **({} if (between := estimate.between_logs) is None else {"between_logs": np.sqrt(between.variance).tolist()}),
        "relative_sigma_percent": [finite(x) for x in estimate.paper_sigma_percent],
        "condition_number": finite(float(estimate.condition_number)),
        "rows": int(estimate.row_count),
        "residual_rms": float(estimate.residual_rms),
    }


def finite(x: float) -> float | None:
    """Return a number, None instead of one that JSON has no word for."""
    return float(x) if isfinite(x) else None


HIDDEN = f".idbench-{socket.gethostname()}-"
"""How the names of hidden folders begin; the number of their process follows. Other machines may share the disk."""

Read = Sequence[Path]
"""Files that a command reads: they are never replaced, not even with --force."""


def require_free_folder(path: Path, option: str, *, force: bool = False) -> None:
    """Raise ResultsError if a folder of new files cannot be made there, or holds files that may not be replaced."""
    if path.is_dir():
        if any(path.iterdir()) and not force:
            raise _taken(path, option)
    elif path.exists():
        raise ResultsError(f"{option} {path} is a file, not a folder: choose another name")
    else:
        _require_place(path, option, ())


def require_free(path: Path, option: str, *, force: bool = False, read: Read = ()) -> None:
    """Raise ResultsError if a file cannot be written to `path`, before the work that it takes; `option` named it.

    `force`: a file that is there may be replaced, but none of those that the command reads.
    """
    _require_place(path, option, read)
    if path.exists() and not force:
        raise _taken(path, option)


def _require_place(path: Path, option: str, read: Read) -> None:
    try:
        if path.is_dir() or not path.absolute().parent.is_dir():
            raise ResultsError(f"{option} {path}: there is no folder {path.parent} for it, or it is a folder itself")
        if any(path.exists() and other.exists() and path.samefile(other) for other in read):
            raise ResultsError(f"{option} {path} is a file that this command reads: choose another name")
    except OSError as error:
        raise ResultsError(f"{option} {shortened(path)}: {error.strerror}; choose another name") from error


def _taken(path: Path, option: str) -> ResultsError:
    return ResultsError(f"{option} {path} exists: choose another name, or replace it with --force")


def folder_for(path: Path, option: str) -> Path:
    """Make a folder unless it is there, and return it; raise ResultsError if that fails."""
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise ResultsError(f"{option} {path}: {error.strerror}; choose another folder") from error
    return path


@contextmanager
def new_file(path: Path, option: str, *, force: bool = False, read: Read = ()) -> Iterator[Path]:
    """Give a hidden file to write to; on success it becomes `path`.

    Raises
    ------
    ResultsError
        If there is a file with other contents and it may not be replaced, or it cannot be written.
    """
    _require_place(path, option, read)
    try:
        with hidden_folder(path.absolute().parent) as folder:
            hidden = folder / path.name
            yield hidden
            try:
                exchange(hidden, path, force=force)
            except FileExistsError:
                if not path.is_file() or not cmp(hidden, path, shallow=False):
                    raise _taken(path, option) from None
    except OSError as error:
        raise ResultsError(f"cannot write {option} {path}: {error.strerror or error}; choose another place") from error


def write_text(path: Path, text: str, option: str, *, force: bool = False, read: Read = ()) -> None:
    """Write `text` to `path`, whole or not at all; raise ResultsError as `new_file` does."""
    with new_file(path, option, force=force, read=read) as file:
        file.write_text(text, encoding="utf-8", errors="backslashreplace")  # names of files need not be UTF-8


def replace_own(path: Path, text: str) -> None:
    """Write `text` to a file of which idbench alone knows, whole or not at all; raise ResultsError if that fails."""
    try:
        with hidden_folder(path.parent) as folder:
            (folder / path.name).write_text(text, encoding="utf-8")
            (folder / path.name).replace(path)
    except OSError as error:
        raise ResultsError(f"cannot write {path}: {error.strerror}; choose another place") from error


def exchange(written: Path, target: Path, *, force: bool) -> None:
    """Move a file to its place; raise FileExistsError if there is another now that may not be replaced."""
    if force:
        written.replace(target)
        return
    try:
        target.hardlink_to(written)  # unlike a renamed file, a link never takes another's place
    except FileExistsError:
        raise
    except OSError:  # a file system without links
        if target.exists():
            raise FileExistsError(target) from None
        written.replace(target)


@contextmanager
def hidden_folder(folder: Path) -> Iterator[Path]:
    """Give a hidden folder on the same file system, which goes at the end; those of processes that were killed go first."""
    for left in folder.glob(f"{HIDDEN}*-*"):
        number = left.name.removeprefix(HIDDEN).split("-")[0]
        if number.isdigit() and not _is_running(int(number)):
            rmtree(left, ignore_errors=True)
    hidden = Path(tempfile.mkdtemp(prefix=f"{HIDDEN}{os.getpid()}-", dir=folder))
    try:
        yield hidden
    finally:
        rmtree(hidden, ignore_errors=True)


def _is_running(process: int) -> bool:
    try:
        os.kill(process, 0)
    except OSError as error:  # others than this: it is somebody else's
        return not isinstance(error, ProcessLookupError)
    return True


NAME = ".idbench.json"  # Name of its file in a folder


@dataclass(frozen=True)
class WrittenFile:
    """A file that idbench wrote."""

    command: str
    """The command that wrote it."""
    digests: tuple[str, ...]
    """Of its content, and of that which was there before: an exchange may have been cut off between the two."""


@dataclass(frozen=True)
class Manifest:
    """The files of a folder that idbench wrote."""

    folder: Path
    """The folder."""
    files: Mapping[str, WrittenFile] = field(default_factory=dict)
    """By their names."""

    @classmethod
    def of(cls, folder: Path) -> Self:
        """Return the manifest of a folder; an empty one if it has none that can be read."""
        try:
            content: Mapping[str, Any] = json.loads((folder / NAME).read_text(encoding="utf-8"))["files"]
            files = {name: WrittenFile(str(w["command"]), tuple(map(str, w["digests"]))) for name, w in content.items()}
        except (OSError, ValueError, KeyError, TypeError, AttributeError, RecursionError):
            return cls(folder)
        return cls(folder, files)

    def owns(self, name: str) -> bool:
        """True if a file is there and as idbench wrote it."""
        path = self.folder / name
        return name in self.files and path.is_file() and digest(path) in self.files[name].digests

    @property
    def commands(self) -> list[str]:
        """The commands whose files are still there."""
        return list(dict.fromkeys(w.command for name, w in self.files.items() if (self.folder / name).is_file()))

    def save(self, written: Mapping[str, WrittenFile], gone: Iterable[str] = ()) -> None:
        """Write it with files that were written, and without those that are gone."""
        files = {name: w for name, w in self.files.items() if name not in set(gone)}
        for name, new in written.items():
            before = files[name].digests[:1] if name in files else ()
            files[name] = WrittenFile(new.command, tuple(dict.fromkeys((*new.digests, *before))))
        content = {name: {"command": w.command, "digests": list(w.digests)} for name, w in sorted(files.items())}
        about = "files that idbench wrote here: it replaces no others"
        replace_own(self.folder / NAME, json.dumps({"about": about, "files": content}, indent=1) + "\n")


def digest(path: Path) -> str:
    """Digest of a file's content."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
