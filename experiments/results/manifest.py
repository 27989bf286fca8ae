"""Which files of a folder idbench wrote, by which command, and whether they are still as it wrote them."""

import hashlib
import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Self, final

from idbench.experiments.results.writing import replace_own

NAME = ".idbench.json"
"""Name of its file in a folder."""


@final
@dataclass(frozen=True)
class WrittenFile:
    """A file that idbench wrote."""

    command: str
    """The command that wrote it."""
    digests: tuple[str, ...]
    """Of its content, and of that which was there before: an exchange may have been cut off between the two."""


@final
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
        """Return whether a file is there and as idbench wrote it."""
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
    """Return what tells the content of a file from others."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
