"""What a file of a log holds: columns that have names."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from idbench.identify.arrays import Array
from idbench.identify.errors import LogError


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
