"""The kinds of files that logs are read from, and their table."""

import stat
from collections.abc import Callable
from pathlib import Path

from idbench.identify.errors import LogError
from idbench.identify.files.arrays import read_matlab, read_numpy
from idbench.identify.files.arrow import read_parquet, read_text
from idbench.identify.files.lerobot import data_file, is_data_set
from idbench.identify.files.ros_bag import read_bag
from idbench.identify.files.table import LogTable

TEXT = (".csv", ".txt", ".tsv", ".dat")  # What names of text files end with

FORMATS: dict[str, Callable[[Path], LogTable]] = {
    **dict.fromkeys(TEXT, read_text),
    ".parquet": read_parquet,
    ".npz": read_numpy,
    ".npy": read_numpy,
    ".mat": read_matlab,
    ".bag": read_bag,
    ".db3": read_bag,
    ".mcap": read_bag,
}
"""Readers by what a file's name ends with, `.gz` aside."""

CODE = "it may run code when it is loaded; load it where it was made, and save its arrays with numpy.savez"
TREE = "it has no columns; save those of the log, such as with pandas.DataFrame(...).to_csv"

FOREIGN = {
    **dict.fromkeys((".pkl", ".pt", ".pth"), CODE),
    **dict.fromkeys((".json", ".jsonl", ".yaml", ".yml"), TREE),
    **dict.fromkeys((".h5", ".hdf5", ".feather", ".arrow", ".xlsx", ".xls"), "save it as CSV or Parquet"),
}
"""What is not read, and the way out."""


def kind_of(path: Path) -> str:
    """Return what the name of a file ends with, without what says that it is packed."""
    return Path(path.stem).suffix.lower() if path.suffix.lower() == ".gz" else path.suffix.lower()


def require_file(path: Path) -> None:
    """Raise LogError if a path is a pipe or a device: it would be waited for, and a log is read more than once."""
    kind = path.stat().st_mode
    if not (stat.S_ISREG(kind) or stat.S_ISDIR(kind)):
        what = "a pipe" if stat.S_ISFIFO(kind) else "no file"
        raise LogError(f"{path} is {what}: a log is read more than once; write it to a file, such as log.csv, and name that")


ROBOTS = (".urdf", ".mjcf", ".xacro", ".sdf")  # Endings of files of robots, which are easily given in the place of a log


def read_table(path: Path) -> LogTable:
    """Return what a file holds.

    Raises
    ------
    LogError
        If it cannot be read, is of no kind that is known, or is empty.
    """
    if is_data_set(path):
        path = data_file(path)
    bag = path.is_dir() and (path / "metadata.yaml").is_file()
    if path.is_dir() and not bag and not any(path.glob("*.parquet")):
        raise LogError(f"{path} is a folder: give a file in it, such as its log.parquet")
    if path.suffix.lower() in ROBOTS:
        raise LogError(f"{path} is the file of a robot, no log: give the log here, and the robot (MJCF or URDF) by --robot")
    if not bag and (way_out := FOREIGN.get(kind_of(path))):
        raise LogError(f"idbench reads no {kind_of(path)} ({path}): {way_out}. It reads {', '.join(FORMATS)}")
    reader = read_bag if bag else FORMATS.get(kind_of(path), read_parquet)
    try:
        if not bag:
            require_file(path)
            with path.open("rb"):  # whatever the reader is, a missing file is said in the same words
                pass
        table = reader(path)
    except OSError as error:
        raise LogError(f"cannot read the log {path}: {error.strerror or error}") from error
    if not table.rows and table.words:
        name, what = next(iter(table.words.items()))
        raise LogError(f"{path}: no column holds numbers: {name} holds {what}")
    if not table.rows:
        raise LogError(f"{path} holds no samples: there is no row of numbers below its header")
    return table
