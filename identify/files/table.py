"""What a file of a log holds: columns that have names."""

import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from idbench.identify.arrays import Array
from idbench.identify.errors import LogError

COPIES = 3
"""How often the values of a log are in memory at once while it is read and turned into SI."""


def require_room(path: Path, what: str, size: int) -> None:
    """Raise LogError if the values of a file, of so many bytes, are more than this process can hold."""
    if (needed := 1e-9 * COPIES * size) > (room := memory()):
        raise LogError(
            f"{path} says that it holds {what}: reading them takes {needed:.3g} GB, and there are {room:.3g} GB: cut the log"
        )


def memory() -> float:
    """Return the memory that this process may have [GB]: of the machine, or its limit; infinity where nobody says."""
    try:
        found = 1e-9 * os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    except (AttributeError, ValueError, OSError):
        found = float("inf")
    try:
        import resource
    except ImportError:  # not on Windows
        return found
    limit, _ = resource.getrlimit(resource.RLIMIT_AS)
    return found if limit == resource.RLIM_INFINITY else min(found, 1e-9 * limit)


@dataclass(frozen=True, eq=False)
class LogTable:
    """Columns of a file by their names, as they are in it."""

    columns: Mapping[str, Array]
    """A column may be of several entries, as arrays of NumPy and lists of Parquet are, shape (row,) or (row, entry)."""
    torque: bytes | None = None
    """What the file itself says of its torque, as idbench writes it."""
    named: bool = True
    """Whether the names are those of the file, and not numbers of its columns."""
    entries: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    """Names of the entries of a column, where the file has them (joints of a JointState)."""
    words: Mapping[str, str] = field(default_factory=dict)
    """Columns that hold no numbers, and what they do hold."""

    @property
    def rows(self) -> int:
        """Number of rows of the longest column."""
        return max((len(column) for column in self.columns.values()), default=0)

    def require(self, name: str, path: Path) -> Array:
        """Return a column; raise LogError that lists those of the file if it has none of this name, or of words."""
        if name in self.words:
            raise LogError(f"{path}: column {name} holds {self.words[name]}")
        if name not in self.columns:
            known = ", ".join(list(self.columns)[:40]) or "none"
            raise LogError(f"{path} has no column {name!r}; its columns: {known}")
        return self.columns[name]
