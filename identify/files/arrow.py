"""Text and Parquet files, read by pyarrow, which only this file and the one that writes logs need."""

import gzip
import re
from collections.abc import Iterable, Sequence
from dataclasses import replace
from pathlib import Path
from types import ModuleType
from typing import IO, TYPE_CHECKING, Any

import numpy as np

from idbench.identify.arrays import Array
from idbench.identify.errors import LogError
from idbench.identify.files.lerobot import names_beside
from idbench.identify.files.ros_text import ros_table
from idbench.identify.files.table import LogTable, require_room

if TYPE_CHECKING:
    import pyarrow as pa

TORQUE = b"idbench.torque"  # Key of what a Parquet file says of its torque
BOM = b"\xef\xbb\xbf"  # How some programs begin a file of UTF-8
MOST_BEFORE = 100  # Lines before a table that are looked through for its beginning
LARGEST = 2**53  # Integers up to this are numbers of double precision

PRINTED = re.compile(rb"%time,|\d+,\d+,[^,]*,[A-Za-z_]")  # How text begins that ROS printed

NUMBER = r"[-+.\deE,]*\d[-+.\deE,]*|[-+]?(nan|inf|infinity)"


def arrow() -> ModuleType:
    """Return pyarrow; raise LogError if it is not installed."""
    try:
        import pyarrow
    except ModuleNotFoundError as error:
        if error.name != "pyarrow":
            raise
        raise LogError(
            "files of logs are read and written with pyarrow: pip install pyarrow; or make a MotionLog of your own arrays"
        ) from error
    except ImportError as error:
        raise LogError(
            f"pyarrow is installed and cannot be loaded: {error}; is memory limited (ulimit -v)? Or install it anew: pip "
            "install --force-reinstall pyarrow"
        ) from error
    return pyarrow


def read_text(path: Path) -> LogTable:
    """Return the columns of a text file: CSV, with semicolons, tabs or blanks, with a line of names or without, packed or not.

    Without a line of names columns are called 1, 2, ...; lines that begin with # or % before the numbers are passed over,
    the last of them may hold the names; so are those of a drive's trace before its table.
    """
    pa = arrow()
    from pyarrow import csv

    try:
        with _opened(path) as file:
            first_line = file.readline()
            if PRINTED.match(first_line):
                found = ros_table([first_line.decode("utf-8"), *file.read().decode("utf-8").splitlines()])
                if found is not None:
                    return found
        skipped, names, mark, before = _head(path)
        if not names:
            _require_no_units(path, skipped, mark)
        if mark == b" ":
            return _blanks(path, skipped, names)
        read = csv.ReadOptions(skip_rows=skipped, column_names=names or None)
        parse = csv.ParseOptions(delimiter=mark.decode())
        convert = csv.ConvertOptions(decimal_point=_decimal(path, skipped, mark))
        held: Any = _held(path)  # the stubs know files of Python alone
        table = csv.read_csv(held, read_options=read, parse_options=parse, convert_options=convert)
    except UnicodeDecodeError as error:
        raise LogError(f"cannot read the log {path}: byte {error.start} of its header is no UTF-8; save it as UTF-8") from error
    except LogError:
        raise
    except (pa.ArrowException, gzip.BadGzipFile, EOFError, ValueError) as error:
        raise LogError(f"cannot read the log {path} as CSV: {str(error).splitlines()[0]}") from error
    first = 1 + skipped + (0 if names else 1)
    values = (_numbers(column, first) for column in table.columns)
    found = _table(path, table.column_names, values, named=not names or not names[0].isdigit())
    return replace(found, said=f"{before} lines before its table are passed over" if before else "")


def read_parquet(path: Path) -> LogTable:
    """Return the columns of a Parquet file that hold numbers, or lists of numbers of one length (LeRobot)."""
    pa = arrow()
    from pyarrow import parquet

    try:
        table = _numeric(path, parquet.ParquetFile(_held(path)))
    except pa.ArrowException as error:
        words = str(error).splitlines()[0]
        raise LogError(f"cannot read the log {path} as Parquet (a CSV file's name must end with .csv): {words}") from error
    made = _table(path, table.column_names, map(_entries, table.columns), (table.schema.metadata or {}).get(TORQUE))
    entries = {name: x for name, x in names_beside(path).items() if name in made.columns}
    return replace(made, entries={name: x for name, x in entries.items() if made.columns[name].shape[1:] == (len(x),)})


def _opened(path: Path) -> IO[bytes]:
    return gzip.open(path, "rb") if path.suffix.lower() == ".gz" else path.open("rb")  # type: ignore[return-value]


def _held(path: Path) -> "pa.BufferReader":
    """Content of a file, in memory of pyarrow's own.

    Its threads that read a file of Python's abort a process that ends meanwhile (apache/arrow 50482), and its own way to open
    one takes names in UTF-8 alone.
    """
    pa = arrow()
    with _opened(path) as file:
        content = file.read()
    held = pa.allocate_buffer(len(content))
    memoryview(held).cast("B")[:] = content
    return pa.BufferReader(held)


def _head(path: Path) -> tuple[int, list[str], bytes, int]:
    """Number of lines to skip, names if the file has no line of them there, the separator, and lines that are no comments."""
    with _opened(path) as file:
        lines = [file.readline() for _ in range(200)]
    skipped = next((i for i, line in enumerate(lines) if line.strip() and line[:1] not in b"#%"), 0)
    commented, skipped = skipped, _table_begins(lines, skipped)
    before = skipped - commented
    first, comment = lines[skipped].removeprefix(BOM), lines[skipped - 1].lstrip(b"#% ") if skipped else b""
    mark = next((mark for mark in (b"\t", b";", b",", b" ") if mark in first.strip()), b",")
    if mark == b"," and len(blanks := first.split()) > 1 and all(re.fullmatch(rb"[-+]?\d+(,\d+)?", x) for x in blanks):
        mark = b" "  # decimal commas
    cells = _cells(first, mark)
    if not all(re.fullmatch(NUMBER, cell, re.IGNORECASE) for cell in cells if cell):
        return skipped, [], mark, before
    named = _cells(comment, mark)
    return skipped, named if len(named) == len(cells) else [str(i + 1) for i in range(len(cells))], mark, before


def _table_begins(lines: Sequence[bytes], first: int) -> int:
    """Place of the names of a table that begins after other lines: those above rows of numbers, of as many cells.

    `first` where it has as many cells as the line below it, of which some are numbers, or where there is no such table.
    """

    def cells_of(k: int, mark: bytes) -> list[str]:
        return _cells(lines[k].decode("utf-8", errors="replace").encode(), mark) if k < len(lines) and lines[k].strip() else []

    def size(k: int, mark: bytes) -> int:
        return len(cells_of(k, mark))

    def numbers(k: int, mark: bytes) -> bool:
        cells = [cell for cell in cells_of(k, mark) if cell]
        return bool(cells) and all(re.fullmatch(NUMBER, cell, re.IGNORECASE) for cell in cells)

    def words(k: int, mark: bytes) -> list[str]:
        cells = cells_of(k, mark)
        return cells[: max((i + 1 for i, cell in enumerate(cells) if cell), default=0)]  # without what trailing commas make

    for mark in (b"\t", b";", b","):
        below = next((k for k in range(first + 1, len(lines)) if lines[k].strip()), first)
        head, row = words(first, mark), words(below, mark)
        number = [bool(re.fullmatch(NUMBER, cell, re.IGNORECASE)) for cell in row if cell]
        if 1 < len(head) == len(row) and (any(number) or below == first):  # names above values, whatever else is among these
            return first
        for k in range(first, min(len(lines), MOST_BEFORE) - 2):
            n = size(k, mark)
            if n > 1 and n == size(k + 1, mark) == size(k + 2, mark) and numbers(k + 1, mark) and numbers(k + 2, mark):
                units = k > first and n == size(k - 1, mark) and not numbers(k, mark)  # below the names
                return k - units
    return first


def _cells(line: bytes, mark: bytes) -> list[str]:
    text = line.decode("utf-8").strip()
    return text.split() if mark == b" " else [cell.strip(' "') for cell in text.split(mark.decode())]


def _require_no_units(path: Path, skipped: int, mark: bytes) -> None:
    """Raise LogError if the line below the names has no number, as one of units has none."""
    with _opened(path) as file:
        below = [file.readline() for _ in range(skipped + 2)][-1]
    cells = [cell for cell in _cells(below.decode("utf-8", errors="replace").encode(), mark) if cell]
    if cells and not any(re.fullmatch(NUMBER, cell, re.IGNORECASE) for cell in cells):
        raise LogError(
            f"{path}: line {skipped + 2} holds no numbers but {', '.join(cells):.60}: if these are units, take the line "
            "out, and say those that are not SI with --units, such as q=deg tau=mNm, or in a log.toml"
        )


def _decimal(path: Path, skipped: int, mark: bytes) -> str:
    """Return the decimal mark, as the first rows show."""
    with _opened(path) as file:
        rows = b"".join([file.readline() for _ in range(skipped + 20)][skipped + 1 :])
    return "," if mark != b"," and b"," in rows and b"." not in rows else "."


def _blanks(path: Path, skipped: int, names: list[str]) -> LogTable:
    """Return the columns of a file that separates them by blanks."""
    with _opened(path) as file:
        lines = file.read().decode("utf-8").splitlines()[skipped:]
    found, given = names or lines[0].lstrip("\ufeff").split(), lines if names else lines[1:]
    _require_single(path, found)
    decimal = any("," in line for line in given) and not any("." in line for line in given)
    try:
        rows = (line.replace(",", ".") if decimal else line for line in given if line.strip())
        values = np.array([[float(cell) for cell in line.lstrip("\ufeff").split()] for line in rows])
    except ValueError as error:
        raise LogError(f"cannot read the log {path}: {error}") from error
    if values.ndim != 2 or values.shape[1] != len(found):
        raise LogError(f"cannot read the log {path}: its rows are not of {len(found)} numbers each, {', '.join(found)}")
    return LogTable(dict(zip(found, values.T, strict=True)), named=not names or not names[0].isdigit())


def _require_single(path: Path, names: Sequence[str]) -> None:
    if twice := sorted({name for name in names if names.count(name) > 1}):
        raise LogError(f"{path}: columns missing, left over or twice: {', '.join(twice)}")


def _numeric(path: Path, file: Any) -> "pa.Table":
    """Return the columns of a Parquet file that may be numbers; raise LogError before anything is read that no memory holds.

    A file of some kilobytes may hold a column of terabytes, all values being the same.
    """
    types = arrow().types
    wanted = list[str]()
    size = 0
    for field in file.schema_arrow:
        kind = field.type
        if types.is_list(kind) or types.is_fixed_size_list(kind) or types.is_large_list(kind):
            kind, size = kind.value_type, size + 16
        if types.is_floating(kind) or types.is_integer(kind) or types.is_null(kind) or types.is_timestamp(kind):
            wanted, size = [*wanted, field.name], size + 8
        elif re.fullmatch(r"t|(q|tau)\d+", field.name.strip(' "')):
            raise LogError(f"{path}: column {field.name} holds {kind}, not numbers")
    rows = file.metadata.num_rows
    require_room(path, f"{rows:.3g} samples of {len(wanted)} columns", rows * size)
    return file.read(columns=wanted)


def _entries(column: "pa.ChunkedArray[Any]") -> Array | str:
    """Return a column of numbers, shape (row,), or of lists of numbers, shape (row, entry); what it holds if neither."""
    pa = arrow()
    if not (pa.types.is_list(column.type) or pa.types.is_fixed_size_list(column.type) or pa.types.is_large_list(column.type)):
        return _numbers(column, 1)
    whole = column.combine_chunks()
    import pyarrow.compute  # which takes 60 ms, and most files hold no lists

    lengths = set(pyarrow.compute.list_value_length(whole).to_pylist())
    if None in lengths:
        return f"no list in row {whole.is_null().to_pylist().index(True) + 1}"
    if len(lengths) != 1:
        return "lists that differ in length"
    flat = whole.flatten()  # type: ignore[attr-defined]  # of lists
    return _floats(flat).reshape(len(whole), -1)


def _floats(column: Any) -> Array:
    """Return numbers as float64; integers that are too large for it, such as times in ns, from their first value on."""
    values = np.asarray(column.to_numpy(zero_copy_only=False))  # and no cast, which loads Arrow's functions in 0.1 s
    if values.dtype.kind in "iu" and len(values) and max(abs(int(values.min())), abs(int(values.max()))) > LARGEST:
        values = values - values[0]
    return np.asarray(values, dtype=np.float64)


def _numbers(column: "pa.ChunkedArray[Any]", first: int) -> Array | str:
    """Return a column as numbers, an empty cell as NaN, which no log may have; what it holds if these are none."""
    pa = arrow()
    if pa.types.is_temporal(column.type):
        times = column.to_numpy().astype("datetime64[ns]")  # dates, or times of the day: [s] from the first on
        return np.asarray((times - times[0]) / np.timedelta64(1, "s"), dtype=np.float64)
    if not (pa.types.is_floating(column.type) or pa.types.is_integer(column.type) or pa.types.is_null(column.type)):
        return f"{column.type}, not numbers{_culprit(column, first)}"
    return _floats(column.combine_chunks() if column.num_chunks > 1 else column.chunk(0)) if column.num_chunks else np.empty(0)


def _culprit(column: "pa.ChunkedArray[Any]", first: int) -> str:
    """Return the first cell of a column that is no number, and its line."""
    for k, cell in enumerate(column.to_pylist()):
        try:
            float(cell if cell is not None else "nan")
        except (TypeError, ValueError):
            return f": {cell!r:.40} in line {k + first}"
    return ""


def _table(
    path: Path, names: Sequence[str], values: Iterable[Array | str], torque: bytes | None = None, named: bool = True
) -> LogTable:
    """Return a table of the columns that are numbers, and of what the others are."""
    cleaned = [name.strip(' "') for name in names]
    _require_single(path, cleaned)
    found = dict(zip(cleaned, values, strict=True))
    words = {name: column for name, column in found.items() if isinstance(column, str)}
    return LogTable({name: column for name, column in found.items() if not isinstance(column, str)}, torque, named, words=words)
