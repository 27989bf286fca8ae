"""The folder of an experiment's results: held while it is written, complete or absent, and never somebody else's."""

import json
from collections.abc import Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager, suppress
from dataclasses import dataclass
from fnmatch import fnmatch
from pathlib import Path
from typing import Any

from idbench.experiments.errors import REPORT, ResultsError
from idbench.experiments.results.writing import NAME, Manifest, Read, WrittenFile, digest, exchange, hidden_folder, locked

RECORDING = "recording.rrd"  # The recording to which identifications add their layers

COMMON = ("summary.json", RECORDING, "recording.*.rrd", "log*.parquet", REPORT)

FILES: Mapping[str, tuple[str, ...]] = {
    "run": (*COMMON, "scenario.toml", "servo.toml", "commands.csv"),
    "identify": (*COMMON, "report.html"),
    "table1": COMMON,
    "table1-motions": ("summary.json",),
    "table2": COMMON,
    "excite": (*COMMON, "scenario.toml", "report.html", "motion*.csv"),
    "payload": ("summary.json", REPORT),
    "gains": ("summary.json", REPORT),
    "servo": ("summary.json", RECORDING, REPORT),
    "study": ("summary.json", "report.html", RECORDING, REPORT),
}
"""What an experiment may write: files of these names are looked for before the work."""


@dataclass(frozen=True)
class ResultsFolder:
    """The folder of an experiment's results."""

    out: Path
    """The folder."""
    experiment: str
    """Which kind of experiment writes there."""
    command: str
    """The command that makes the results, with all options on which they depend."""
    force: bool = False
    """Whether files of others may be replaced."""
    read: Read = ()
    """Files that the command reads: they are never replaced."""

    def check(self) -> None:
        """Raise ResultsError if the results cannot go there, or files of others would have to go."""
        with self._writing():
            if str(self.out) == "." and not self.force:
                raise ResultsError("--out is the folder that you are in, or empty: name a folder of its own for the results")
            if self.out.exists() and not self.out.is_dir():
                raise ResultsError(f"{self.out} is a file, not a folder: choose another --out")
            if not self.out.is_dir():
                return
            if read := next((path for path in self.out.iterdir() if self._writes(path.name) and self._reads(path)), None):
                raise ResultsError(f"{read} is a file that this command reads, and results take its name: choose another --out")
            if self.force:
                return
            if (self.out / "study.toml").is_file() and self.experiment != "study":
                raise ResultsError(f"{self.out} holds a study: choose another --out")
            manifest = Manifest.of(self.out)
            there = sorted({path.name for pattern in FILES[self.experiment] for path in self.out.glob(pattern)})
            if strange := [name for name in there if not manifest.owns(name)]:
                raise ResultsError(
                    f"{self.out} holds {_summarized(self.out)}{', '.join(strange)}, not written by idbench or changed since: "
                    "choose another --out, or replace them with --force"
                )
            if others := [command for command in manifest.commands if command != self.command]:
                raise ResultsError(
                    f"{self.out} holds the results of `{others[0]}`: choose another --out, or replace them with --force"
                )

    @contextmanager
    def held(self) -> Iterator[None]:
        """Check the folder, make it if it is not there, and hold it against other processes until the end of the block.

        Raises
        ------
        ResultsError
            As `check` does, or if another process holds it.
        """
        self.check()
        made = [folder for folder in (self.out, *self.out.parents) if not folder.exists()]  # the innermost first
        with self._writing():
            self.out.mkdir(parents=True, exist_ok=True)
        busy = f"another process is writing its results to {self.out}: wait for it, or choose another --out"
        try:
            with locked(self.out, ResultsError(busy)):
                yield
        finally:
            for folder in made:  # where nothing came into them
                with suppress(OSError):
                    folder.rmdir()

    def changes(self, summary: Mapping[str, Any]) -> str:
        """Return the parameter that differs most from the results that are there, in words; empty if none does."""
        moved = list[tuple[float, str]]()
        with suppress(OSError, ValueError, KeyError, TypeError, AttributeError, RecursionError):  # whatever the file is
            before = json.loads((self.out / "summary.json").read_text(encoding="utf-8"))["models"]
            for model, found in summary["models"].items():
                for name, p in found["parameters"].items():
                    if (old := before[model]["parameters"][name]["value"]) != p["value"]:
                        words = f"{name} of the {model} model from {old:.5g} to {p['value']:.5g} {p['unit']}"
                        moved.append((abs(p["value"] - old) / p["sigma"], words))
        size, most = max(moved, default=(0.0, ""))
        return f"changed since the last results there: {most} ({size:.2g} sigma), the most of {len(moved)}" if most else ""

    def complete(self) -> AbstractContextManager[Path]:
        """Give a hidden folder to write results to; on success they take the place of all earlier ones, summary.json last.

        Raises
        ------
        ResultsError
            If they cannot be written, or files have come meanwhile that idbench did not write.
        """
        return self._exchanged(complete=True)

    def more(self) -> AbstractContextManager[Path]:
        """Give a hidden folder to write further files to; on success they come beside the results; errors as `complete`."""
        return self._exchanged(complete=False)

    def add(self, name: str, content: str | bytes) -> None:
        """Write one further file; errors as `complete`."""
        with self.more() as hidden:
            (hidden / name).write_bytes(content if isinstance(content, bytes) else content.encode("utf-8", "backslashreplace"))

    @contextmanager
    def _exchanged(self, *, complete: bool) -> Iterator[Path]:
        with self._writing(), hidden_folder(self.out) as hidden:
            yield hidden
            self._exchange(hidden, complete=complete)

    def _exchange(self, hidden: Path, *, complete: bool) -> None:
        manifest = Manifest.of(self.out)
        paths = sorted(hidden.iterdir(), key=lambda path: (path.name == "summary.json", path.name))
        own = {path.name for path in paths if manifest.owns(path.name)}
        for path in paths:
            self._require_exchangeable(self.out / path.name, path.name in own)
        gone = {name for name in manifest.files if complete and self._writes(name) and manifest.owns(name)}
        gone -= {path.name for path in paths}
        kept = {} if complete or self.force else manifest.files  # of another command, and only laid out anew
        commands = {path.name: kept[path.name].command if path.name in kept else self.command for path in paths}
        manifest.save({path.name: WrittenFile(commands[path.name], (digest(path),)) for path in paths}, gone)
        for path in paths:
            try:
                unchanged = path.name in own and manifest.owns(path.name)  # looked at once more
                exchange(path, self.out / path.name, force=self.force or unchanged)
            except FileExistsError:
                raise self._strange(self.out / path.name) from None
        for name in gone:
            (self.out / name).unlink(missing_ok=True)

    def _require_exchangeable(self, target: Path, own: bool) -> None:
        """Raise ResultsError if a file must not be replaced."""
        if target.is_dir():
            raise ResultsError(f"{target} is a folder where a file must go: remove it or choose another --out")
        if self._reads(target):
            raise ResultsError(f"{target} is a file that this command reads: choose another --out")
        if target.exists() and not own and not self.force:
            raise self._strange(target)

    def _writes(self, name: str) -> bool:
        """True if results may have a file of that name."""
        return any(fnmatch(name, pattern) for pattern in FILES[self.experiment])

    def _reads(self, target: Path) -> bool:
        """True if a file is one that the command reads."""
        return any(target.exists() and path.exists() and target.samefile(path) for path in self.read)

    def goes_beside(self, path: Path, option: str) -> bool:
        """True if a further file goes beside the results; raise ResultsError if it has the name of one of them."""
        if path.absolute().parent != self.out.absolute():
            return False
        if self._writes(path.name) or path.name == NAME:
            raise ResultsError(f"{option} {path}: the results have a file of that name; choose another")
        if path.exists() and not self.force and not Manifest.of(self.out).owns(path.name):
            raise self._strange(path)
        return True

    def _strange(self, target: Path) -> ResultsError:
        return ResultsError(
            f"{target} exists, and idbench did not write it as it is: choose another --out, or replace it with --force"
        )

    @contextmanager
    def _writing(self) -> Iterator[None]:
        """Turn errors of the file system into a ResultsError."""
        try:
            yield
        except OSError as error:
            why = error.strerror or error
            raise ResultsError(f"cannot write to {self.out}: {why}; choose another --out, or free some space") from error


def _summarized(folder: Path) -> str:
    """Experiment of a folder by its summary."""
    try:
        found = json.loads((folder / "summary.json").read_text(encoding="utf-8"))["experiment"]
    except (OSError, ValueError, KeyError, TypeError, RecursionError):
        return ""
    return f"{found!s:.40}: "
