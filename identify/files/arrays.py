"""Files of arrays: NumPy's and Matlab's."""

import zipfile
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import scipy

from idbench.identify.arrays import Array
from idbench.identify.errors import LogError
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
