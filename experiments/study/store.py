"""The folder of a study: its description, and a Parquet file for every finished shard."""

import json
import os
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any, Self

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import tomli_w

from experiments.errors import ResultsError, StudyError
from experiments.results import write_whole
from experiments.study.shard import PARTS, Shard
from experiments.study.study import Study
from experiments.study.study_file import read_toml, study_from

try:
    import fcntl
except ImportError:  # not on Windows, where two processes in one folder are not noticed
    fcntl = None  # type: ignore[assignment]

MADE_BY = ("idbench", "mujoco", "numpy", "scipy", "ruckig")
"""Packages on which the bits of a result depend."""


@cache
def versions() -> dict[str, str]:
    """Return the versions of the packages on which the bits of a result depend."""
    return {name: _version(name) for name in MADE_BY}


def _version(name: str) -> str:
    try:
        return version(name)
    except PackageNotFoundError:
        return "unknown"


def require_versions(theirs: dict[str, str], whose: str) -> None:
    """Raise StudyError if the versions of another place are not those of this process."""
    other = [f"{name} {theirs.get(name)} (here {here})" for name, here in versions().items() if theirs.get(name) != here]
    if other:
        raise StudyError(f"{whose} has {', '.join(other)}: the same study needs the same versions everywhere")


@dataclass(frozen=True)
class Store:
    """A study and its folder.

    Parameters
    ----------
    study : Study
        What is run.
    folder : Path
        Holds study.toml and shards/.
    """

    study: Study
    folder: Path

    @classmethod
    def new(cls, study: Study, folder: Path) -> Self:
        """Return a study for a new folder, or an empty one; raise StudyError if it holds another, or this one already."""
        described = folder / "study.toml"
        if described.exists():
            same = _read(folder).fingerprint == study.fingerprint
            raise StudyError(
                f"{folder} holds this study already: go on with idbench study --resume {folder}, or choose another --out"
                if same
                else f"{folder} holds another study, or this one before it was changed: choose another --out"
            )
        store = cls(study, folder)
        if store.shards():
            raise StudyError(f"{folder} holds shards but no study.toml: choose another --out")
        return store

    def begin(self) -> None:
        """Make the folder, unless it is there; raise ResultsError if that fails."""
        try:
            (self.folder / "shards").mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise ResultsError(f"cannot write to {self.folder}: {error.strerror}; choose another --out") from error
        if not (self.folder / "study.toml").exists():
            write_whole(self.folder / "study.toml", tomli_w.dumps(self.study.content))

    @classmethod
    def open(cls, folder: Path) -> Self:
        """Return the study of a folder; raise StudyError if there is none, or its shards are of another."""
        if not (folder / "study.toml").is_file():
            raise StudyError(f"there is no study in {folder}: it has no study.toml")
        store = cls(_read(folder), folder)
        for path in store.shards():
            store._require_ours(path)
        return store

    @contextmanager
    def locked(self) -> Iterator[None]:
        """Hold the folder while a study is run; raise StudyError if another process does."""
        if fcntl is None:
            yield
            return
        with (self.folder / ".lock").open("w") as lock:
            try:
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except OSError:
                raise StudyError(f"another process is running the study in {self.folder}: wait for it, or stop it") from None
            yield

    def shards(self) -> list[Path]:
        """Return the files of the finished shards, in the order of their runs."""
        return sorted((self.folder / "shards").glob("runs-*.parquet"))

    def missing(self, shard: int) -> Iterator[range]:
        """Yield the runs that no finished shard holds, at most `shard` at a time and all of one point of the grid."""
        next_run, ends = 0, sorted(_range(path) for path in self.shards())
        for first, last in [*ends, (self.study.size, self.study.size)]:
            while next_run < first:
                end = min(first, next_run + shard, (next_run // self.study.seeds + 1) * self.study.seeds)
                yield range(next_run, end)
                next_run = end
            next_run = max(next_run, last + 1)

    def write(self, runs: range, shard: Shard) -> None:
        """Write a finished shard: beside, and then renamed."""
        path = self.folder / "shards" / f"runs-{runs[0]:010}-{runs[-1]:010}.parquet"
        beside = path.with_name(f".{path.name}.{os.getpid()}")
        said = {"fingerprint": self.study.fingerprint, "versions": json.dumps(versions()), "seconds": json.dumps(shard.seconds)}
        try:
            table = pa.Table.from_pylist(shard.rows, schema=self._schema().with_metadata(said))
            pq.write_table(table, beside)
            with beside.open("rb+") as file:
                os.fsync(file.fileno())
            beside.replace(path)
        except OSError as error:
            raise ResultsError(
                f"cannot write to {self.folder}: {error.strerror or error}; make room and go on: "
                f"idbench study --resume {self.folder}"
            ) from error
        finally:
            beside.unlink(missing_ok=True)

    def table(self) -> pa.Table:
        """Return the rows of all finished shards, by run, method and model."""
        table = pa.concat_tables([pq.read_table(path, partitioning=None) for path in self.shards()])
        return table.replace_schema_metadata(None)

    def columns(self) -> dict[str, np.typing.NDArray[Any]]:
        """Return the columns of that table; words stand once in memory, and None where there is none."""
        table = self.table()
        return {name: _array(table.column(name)) for name in table.column_names}

    def rows_of(self, run: int) -> list[dict[str, Any]]:
        """Return the rows of a run, none if its shard is not finished."""
        for path in self.shards():
            first, last = _range(path)
            if first <= run <= last:
                rows: list[dict[str, Any]] = pq.read_table(path, filters=[("run", "=", run)], partitioning=None).to_pylist()
                return rows
        return []

    def seconds(self) -> dict[str, float]:
        """Return how long simulation and each method took, summed over the finished shards [s]."""
        total: dict[str, float] = {}
        for path in self.shards():
            for what, seconds in json.loads(_said(path)["seconds"]).items():
                total[what] = total.get(what, 0.0) + seconds
        return total

    def _schema(self) -> pa.Schema:
        """Return the columns, the same in every shard."""
        fields: list[Any] = [pa.field("run", pa.int64()), pa.field("seed", pa.int64())]
        for axis in self.study.axes:
            numbers = all(isinstance(v, (int, float)) and not isinstance(v, bool) for v in axis.points)
            kind: Any = pa.float64() if numbers else pa.string()
            fields.append(pa.field(axis.field, kind))
        fields += [pa.field(name, pa.string()) for name in ("chain", "estimator", "model", "failure")]
        fields += [
            pa.field("condition_number", pa.float64()),
            pa.field("rows", pa.int64()),
            pa.field("residual_rms", pa.float64()),
        ]
        return pa.schema(fields + [pa.field(name + part, pa.float64()) for name in self.study.parameters for part in PARTS])

    def _require_ours(self, path: Path) -> None:
        said = _said(path)
        if said.get("fingerprint") != self.study.fingerprint:
            raise StudyError(
                f"{self.folder / 'study.toml'} was changed since {path.name} was made: undo the change, or begin anew in "
                "another --out"
            )
        require_versions(json.loads(said["versions"]), f"the maker of {path.name}")


def _read(folder: Path) -> Study:
    return study_from(read_toml(folder / "study.toml"), f"{folder / 'study.toml'}")


def _said(path: Path) -> dict[str, str]:
    """Return what a shard says of itself."""
    try:
        said = pq.read_schema(path).metadata or {}
    except (OSError, pa.ArrowInvalid) as error:
        raise StudyError(f"{path} is damaged ({error}): remove it, and go on with --resume") from error
    return {key.decode(): value.decode() for key, value in said.items()}


def _array(column: Any) -> np.typing.NDArray[Any]:
    if not pa.types.is_string(column.type):
        return np.asarray(column.to_numpy())
    coded = column.combine_chunks().dictionary_encode()
    words = np.array([*coded.dictionary.to_pylist(), None], dtype=object)
    return words[coded.indices.fill_null(-1).to_numpy(zero_copy_only=False)]


def _range(path: Path) -> tuple[int, int]:
    _, first, last = path.stem.split("-")
    return int(first), int(last)
