"""A finished shard as a Parquet file."""

import json
import os
import re
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from idbench.experiments.errors import ResultsError, StudyError
from idbench.experiments.study.shard import Shard, parts_of
from idbench.experiments.study.study import Study
from idbench.experiments.study.versions import require_versions, versions

NAME = re.compile(r"runs-(\d{10})-(\d{10})\.parquet")


def write_shard(folder: Path, study: Study, runs: range, shard: Shard) -> None:
    """Write a finished shard: beside, and then renamed; raise ResultsError if that fails."""
    path = folder / f"runs-{runs[0]:010}-{runs[-1]:010}.parquet"
    beside = path.with_name(f".{path.name}.{os.getpid()}")
    metadata = {"fingerprint": study.fingerprint, "versions": json.dumps(versions()), "seconds": json.dumps(shard.seconds)}
    try:
        pq.write_table(pa.Table.from_pylist(shard.rows, schema=_schema(study).with_metadata(metadata)), beside)
        with beside.open("rb+") as file:
            os.fsync(file.fileno())
        beside.replace(path)
    except OSError as error:
        raise ResultsError(f"cannot write to {folder}: {error.strerror or error}; make room and go on with --resume") from error
    finally:
        beside.unlink(missing_ok=True)


def read_shard(path: Path, run: int | None = None) -> pa.Table:
    """Return the rows of a shard, or those of one run of it; raise StudyError if the file is damaged."""
    try:
        table = pq.read_table(path, filters=None if run is None else [("run", "=", run)], partitioning=None)
    except (OSError, pa.ArrowInvalid) as error:
        raise damaged(path, error) from error
    return table.replace_schema_metadata(None)


def runs_of(path: Path) -> range:
    """Return the runs of a shard, as its name says; raise StudyError if it is not the name of one."""
    match = NAME.fullmatch(path.name)
    if not match:
        raise StudyError(f"{path} is not the name of a shard: remove it")
    return range(int(match[1]), int(match[2]) + 1)


def require_of(path: Path, study: Study) -> None:
    """Raise StudyError unless a shard is of this study as it is now, made by the same versions, and whole."""
    metadata = said_by(path)
    if metadata.get("fingerprint") != study.fingerprint:
        raise StudyError(f"study.toml was changed since {path.name} was made: undo the change, or begin anew in another --out")
    require_versions(json.loads(metadata["versions"]), f"the maker of {path.name}")
    expected = len(runs_of(path)) * len(study.methods) * len(study.models)
    if (rows := pq.read_metadata(path).num_rows) != expected:
        raise StudyError(f"{path} has {rows} rows, its name and the study say {expected}: remove it, and go on with --resume")


def said_by(path: Path) -> dict[str, str]:
    """Return what a shard says of itself; raise StudyError if it is damaged."""
    try:
        metadata = pq.read_schema(path).metadata or {}
    except (OSError, pa.ArrowInvalid) as error:
        raise damaged(path, error) from error
    return {key.decode(): value.decode() for key, value in metadata.items()}


def damaged(path: Path, error: Exception) -> StudyError:
    """Return what is to be metadata of a file that cannot be read."""
    return StudyError(f"{path} is damaged ({' '.join(str(error).split())}): remove it, and go on with --resume")


def arrays(table: pa.Table) -> dict[str, np.typing.NDArray[Any]]:
    """Return the columns of a table; words stand once in memory, and None where there is none."""
    return {name: _array(table.column(name)) for name in table.column_names}


def _array(column: Any) -> np.typing.NDArray[Any]:
    if not pa.types.is_string(column.type):
        return np.asarray(column.to_numpy())
    coded = column.combine_chunks().dictionary_encode()
    words = np.array([*coded.dictionary.to_pylist(), None], dtype=object)
    return words[coded.indices.fill_null(-1).to_numpy(zero_copy_only=False)]


def _schema(study: Study) -> pa.Schema:
    """Return the columns, the same in every shard."""
    fields: list[Any] = [pa.field("run", pa.int64()), pa.field("seed", pa.int64())]
    for axis in study.every_axis:
        kind: Any = pa.float64() if axis.numeric else pa.string()
        fields.append(pa.field(axis.field, kind))
    fields += [pa.field(name, pa.string()) for name in ("chain", "estimator", "model", "failure")]
    quality = {"condition_number": pa.float64(), "rows": pa.int64(), "residual_rms": pa.float64(), "simulations": pa.int64()}
    fields += [pa.field(name, kind) for name, kind in quality.items()]
    return pa.schema(fields + [pa.field(name + part, pa.float64()) for name in study.parameters for part in parts_of(study)])
