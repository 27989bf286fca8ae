"""The kinds of files that logs are read from, and their table."""

import stat
import zipfile
import zlib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import scipy

from idbench.identify.arrays import Array
from idbench.identify.errors import LogError
from idbench.identify.files.arrow import read_parquet, read_text
from idbench.identify.files.lerobot import data_file
from idbench.identify.files.ros_bag import read_bag
from idbench.identify.files.table import LogTable, require_room

BROKEN = (MemoryError, ValueError, EOFError, KeyError, TypeError, zipfile.BadZipFile, zlib.error, OSError)
"""What readers raise of files that are none of theirs."""


def read_numpy(path: Path) -> LogTable:
    """Return the arrays of an .npz file, or the columns of an .npy file: those of a table with names, or called 1, 2, ..."""
    try:
        with path.open("rb") as file:
            found = np.load(file, allow_pickle=False)
            if isinstance(found, np.lib.npyio.NpzFile):
                sizes = [member.file_size for member in found.zip.infolist()] if found.zip else []
                require_room(path, f"{len(sizes)} arrays of {1e-9 * sum(sizes):.3g} GB", sum(sizes))
                return _table({name: _array(found, name) for name in found.files})
    except LogError:
        raise
    except BROKEN as error:
        raise LogError(f"cannot read the log {path} as NumPy's: {str(error).splitlines()[0]}") from error
    if found.dtype.names:
        return _table({name: found[name] for name in found.dtype.names})
    if found.ndim != 2 or found.dtype.kind not in "iufb":
        raise LogError(f"{path} holds an array of {found.dtype} of shape {found.shape}, not numbers (rows, columns)")
    upright = found if found.shape[0] >= found.shape[1] else found.T
    return LogTable({str(i + 1): column for i, column in enumerate(upright.T.astype(np.float64))}, named=False)


def read_matlab(path: Path) -> LogTable:
    """Return the arrays of a MAT file, those inside of structures by their path, such as data.q."""
    try:
        found = scipy.io.loadmat(path, squeeze_me=True, struct_as_record=False)
    except NotImplementedError as error:
        raise LogError(f"{path} is of Matlab 7.3, which is HDF5: save it with '-v7', or export CSV") from error
    except BROKEN as error:
        raise LogError(f"cannot read the log {path} as a MAT file: {str(error).splitlines()[0]}") from error
    return _table({name: x for key, value in found.items() if not key.startswith("__") for name, x in _inside(key, value)})


def _array(file: Any, name: str) -> Any:
    """Return an array of a file; of objects, which are no numbers, their name."""
    try:
        return file[name]
    except ValueError:
        return np.array("objects")


def _inside(name: str, value: Any) -> Iterator[tuple[str, Any]]:
    """Yield arrays of a value of Matlab, which may be a structure."""
    fields = getattr(value, "_fieldnames", None)
    if fields is None:
        yield name, value
        return
    for field in fields:
        yield from _inside(f"{name}.{field}", getattr(value, field))


def _table(arrays: dict[str, Any]) -> LogTable:
    """Return the arrays that may be columns: of numbers, one or two axes, the rows along the longer one."""
    columns, words = dict[str, Array](), dict[str, str]()
    for name, value in arrays.items():
        array = np.asarray(value)
        if array.dtype.kind not in "iufb" or not 1 <= array.ndim <= 2:
            words[name] = f"{array.dtype} of shape {array.shape}, not numbers of one or two axes"
            continue
        upright = array.T if array.ndim == 2 and array.shape[0] < array.shape[1] else array
        flat = upright[:, 0] if upright.ndim == 2 and upright.shape[1] == 1 else upright
        columns[name] = flat.astype(np.float64)
    return LogTable(columns, words=words)


TEXT = (".csv", ".txt", ".tsv", ".dat")  # What names of text files end with

FORMATS: dict[str, Callable[[Path], LogTable]] = {
    **dict.fromkeys(TEXT, read_text),
    ".parquet": read_parquet,
    **dict.fromkeys((".npz", ".npy"), read_numpy),
    ".mat": read_matlab,
    **dict.fromkeys((".bag", ".db3", ".mcap"), read_bag),
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
    """Suffix of a file's name, without that of compression."""
    return Path(path.stem).suffix.lower() if path.suffix.lower() == ".gz" else path.suffix.lower()


def require_file(path: Path) -> None:
    """Raise LogError if a path is a pipe or a device: it would be waited for, and a log is read more than once."""
    kind = path.stat().st_mode
    if not (stat.S_ISREG(kind) or stat.S_ISDIR(kind)):
        what = "a pipe" if stat.S_ISFIFO(kind) else "no file"
        raise LogError(f"{path} is {what}: a log is read more than once; write it to a file, such as log.csv, and name that")


ROBOTS = (".urdf", ".mjcf", ".xacro", ".sdf")  # Endings of files of robots, which are easily given in the place of a log


def read_table(path: Path) -> LogTable:
    """Content of a file.

    Raises
    ------
    LogError
        If it cannot be read, is of no kind that is known, or is empty.
    """
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
