"""The folder that every experiment writes: whole, or not at all."""

import json
import os
import shutil
import socket
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from importlib.metadata import version
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Any
from uuid import uuid4

from experiments.errors import ResultsError
from identify import Estimate

if TYPE_CHECKING:
    from experiments.recording.stream import Stream


HIDDEN = f".idbench-{socket.gethostname()}-"
"""How the names of hidden folders begin; the number of their process follows. Other machines may share the disk."""

WRITTEN = ("summary.json", "log.parquet", "scenario.toml", "recording.rrd")
"""Files of an experiment that others must not lose."""


@dataclass(frozen=True)
class Place:
    """The folder of an experiment's results.

    Parameters
    ----------
    out : Path
        The folder.
    experiment : str
        Which kind of experiment writes there.
    of : str
        What it is about, where one kind has several: the name of a scenario, or of a log.
    force : bool
        Whether results of another experiment may be replaced.
    """

    out: Path
    experiment: str
    of: str = ""
    force: bool = False

    def check(self) -> None:
        """Raise ResultsError if the folder holds results of another experiment, or files that nobody knows."""
        try:
            self._check()
        except OSError as error:
            raise ResultsError(f"cannot write to {self.out}: {error.strerror}; choose another --out") from error

    def _check(self) -> None:
        if str(self.out) == "." and not self.force:
            raise ResultsError("--out is the folder that you are in, or empty: name a folder of its own for the results")
        if self.force or not self.out.is_dir():
            return
        theirs, ours = _experiment_of(self.out), " ".join(filter(None, (self.experiment, self.of)))
        if theirs is not None and theirs != ours:
            raise ResultsError(f"{self.out} holds {theirs}: choose another --out, or replace them with --force")
        taken = [name for name in WRITTEN if (self.out / name).is_file()]
        if theirs is None and taken:
            raise ResultsError(
                f"{self.out} holds {', '.join(taken)}, of no experiment that is known: choose another --out, or replace them "
                "with --force"
            )


def _experiment_of(folder: Path) -> str | None:
    """Return which experiment has written to a folder, as the summary says; None without one."""
    if (folder / "study.toml").is_file():
        return "a study"
    if not (folder / "summary.json").is_file():
        return None
    try:
        summary = json.loads((folder / "summary.json").read_text(encoding="utf-8"))
        named = summary["scenario"]["name"] if summary["experiment"] == "run" else summary.get("path", summary.get("log", ""))
        return " ".join(filter(None, (str(summary["experiment"]), str(named))))
    except (OSError, ValueError, KeyError, TypeError, RecursionError):
        return "something whose summary.json cannot be read"


@contextmanager
def results_folder(place: Place) -> Iterator[Path]:
    """Give a hidden folder to write into; on success its files replace those of the same names in the place.

    Nothing there changes if the block raises, is interrupted or terminated, or the disk is full. The hidden folder lies
    on the same file system, so that the files are only renamed, summary.json last.

    Raises
    ------
    ResultsError
        If the folder cannot be written, is a file, or holds results of another experiment.
    """
    place.check()
    with beside(place.out) as hidden:
        yield hidden


@contextmanager
def beside(out: Path) -> Iterator[Path]:
    """Give a hidden folder to write into; on success its files are moved to the folder `out`, whatever is there."""
    try:
        if out.exists() and not out.is_dir():
            raise ResultsError(f"{out} is a file, not a folder: choose another --out")
        _clear(_nearest_folder(out))
        hidden = Path(tempfile.mkdtemp(prefix=f"{HIDDEN}{os.getpid()}-", dir=_nearest_folder(out)))
    except OSError as error:
        raise ResultsError(f"cannot write to {out}: {error.strerror}; choose another --out") from error
    try:
        yield hidden
        _move(hidden, out)
    except OSError as error:
        raise ResultsError(
            f"cannot write to {out}: {error.strerror or error}; choose another --out, or free some space"
        ) from error
    finally:
        shutil.rmtree(hidden, ignore_errors=True)


def write_recording(folder: Path, streams: "Sequence[tuple[str, Stream]]") -> str:
    """Write the files of a recording; if that fails write none, and return why: the other results are worth keeping."""
    try:
        for name, stream in streams:
            stream.write(folder / name)
    except ResultsError as error:
        for name, _ in streams:
            (folder / name).unlink(missing_ok=True)
        return str(error)
    finally:
        for _, stream in streams:  # when everything is written: a viewer may hang
            stream.close()
    return ""


def tell_of(lost: str, out: Path) -> None:
    """Raise ResultsError if a recording was lost."""
    if lost:
        raise ResultsError(f"{lost}; the other results are in {out}")


def write_whole(path: Path, text: str) -> None:
    """Write `text` to `path`, whole or not at all; raise ResultsError if that fails."""
    try:
        beside = path.parent / f".idbench-{uuid4().hex}"
        try:
            with beside.open("x", encoding="utf-8") as file:
                file.write(text)
            beside.replace(path)
        finally:
            beside.unlink(missing_ok=True)
    except OSError as error:
        raise ResultsError(f"cannot write {path}: {error.strerror}; choose another place") from error


def write_summary(path: Path, summary: dict[str, Any]) -> None:
    """Write `summary` as JSON, with the version of idbench."""
    path.write_text(json.dumps({"version": version("idbench"), **summary}, indent=2, allow_nan=False) + "\n")


def summarize(estimate: Estimate, truth: list[float] | None) -> dict[str, Any]:
    """Return one model's entry of a summary: estimate, error if known, sigmas, Cond(W), rows, residual."""
    return {
        "estimate": estimate.X.tolist(),
        "relative_error_percent": None if truth is None else [_finite(x) for x in estimate.relative_error_percent(truth)],
        "sigma": estimate.sigma.tolist(),
        "corrected_sigma": [_finite(x) for x in estimate.corrected_sigma],
        "relative_sigma_percent": [_finite(x) for x in estimate.relative_sigma_percent],
        "condition_number": float(estimate.condition_number),
        "rows": int(estimate.row_count),
        "residual_rms": float(estimate.residual_rms),
    }


def _finite(x: float) -> float | None:
    return float(x) if isfinite(x) else None


def _clear(folder: Path) -> None:
    """Remove hidden folders that processes of this machine have left there which were killed."""
    for left in folder.glob(f"{HIDDEN}*-*"):
        number = left.name.removeprefix(HIDDEN).split("-")[0]
        if number.isdigit() and not _is_running(int(number)):
            shutil.rmtree(left, ignore_errors=True)


def _is_running(process: int) -> bool:
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except OSError:  # somebody else's
        return True
    return True


def _nearest_folder(out: Path) -> Path:
    """Return `out`, or the nearest folder above it that exists."""
    return next(folder for folder in (out, *out.absolute().parents) if folder.is_dir())


def _move(hidden: Path, out: Path) -> None:
    paths = sorted(hidden.iterdir(), key=lambda path: (path.name == "summary.json", path.name))
    if taken := [path.name for path in paths if (out / path.name).is_dir()]:
        raise ResultsError(f"{out / taken[0]} is a folder where a file must go: remove it or choose another --out")
    out.mkdir(parents=True, exist_ok=True)
    for path in paths:
        path.replace(out / path.name)
    if any(path.name == "summary.json" for path in paths):  # recordings of earlier results are none of these
        patterns = ("recording.rrd", "recording.*.rrd", "log[0-9]*.parquet", "report.html")
        for old in {old for pattern in patterns for old in out.glob(pattern)} - {out / path.name for path in paths}:
            old.unlink()
