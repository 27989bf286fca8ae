"""The folder of a study: its description, and a file for every finished shard."""

import json
import os
import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any, Self

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import tomli_w

from idbench.experiments.errors import ResultsError, StudyError
from idbench.experiments.results.writing import locked, replace_own
from idbench.experiments.study.cluster import require_versions, versions
from idbench.experiments.study.shard import Shard, parts_of
from idbench.experiments.study.statistics import NAMED
from idbench.experiments.study.study import Study
from idbench.experiments.study.study_file import study_from
from idbench.sim.settings import read_toml

NAME = re.compile(r"runs-(\d{10})-(\d{10})\.parquet")


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
    metadata = shard_header(path)
    require_versions(json.loads(metadata.get("versions", "{}")), f"the maker of {path.name}")
    if metadata.get("fingerprint") != study.fingerprint:
        raise StudyError(f"study.toml was changed since {path.name} was made: undo the change, or begin anew in another --out")
    expected = len(runs_of(path)) * len(study.methods) * len(study.models)
    if (rows := pq.read_metadata(path).num_rows) != expected:
        raise StudyError(f"{path} has {rows} rows, its name and the study say {expected}: remove it, and go on with --resume")


def shard_header(path: Path) -> dict[str, str]:
    """Metadata of a shard; raise StudyError if it is damaged."""
    try:
        metadata = pq.read_schema(path).metadata or {}
    except (OSError, pa.ArrowInvalid) as error:
        raise damaged(path, error) from error
    return {key.decode(): value.decode() for key, value in metadata.items()}


def damaged(path: Path, error: Exception) -> StudyError:
    """Error of a shard that cannot be read."""
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
    fields += [pa.field(name, pa.float64()) for name in NAMED if study.causes]
    return pa.schema(fields + [pa.field(name + part, pa.float64()) for name in study.parameters for part in parts_of(study)])


@dataclass(frozen=True)
class Store:
    """A study and its folder."""

    study: Study
    """What is run."""
    folder: Path
    """Holds study.toml and shards/."""

    @classmethod
    def new(cls, study: Study, folder: Path) -> Self:
        """Return a study for a new folder, or an empty one; raise StudyError if it holds another, or this one already."""
        store = cls(study, folder)
        if (folder / "study.toml").exists():
            store._require_same()
            raise StudyError(
                f"{folder} holds this study already: go on with idbench study --resume {folder}, or choose another --out"
            )
        if (folder / "scenario.toml").exists():
            raise StudyError(f"{folder} holds a run: choose another --out")
        if store.shards():
            raise StudyError(f"{folder} holds shards but no study.toml: choose another --out")
        return store

    @classmethod
    def open(cls, folder: Path) -> Self:
        """Return the study of a folder; raise StudyError if there is none, or its shards are not of it."""
        if not (folder / "study.toml").is_file():
            raise StudyError(f"there is no study in {folder}: it has no study.toml")
        store = cls(_read(folder), folder)
        for path in store.shards():
            require_of(path, store.study)
        for one, other in pairwise(store.shards()):
            if runs_of(one).stop > runs_of(other).start:
                raise StudyError(f"{one.name} and {other.name} in {folder} hold the same runs: remove one of them")
        return store

    @contextmanager
    def held(self) -> Iterator[None]:
        """Make the folder unless it is there, and hold it while the study is run.

        StudyError if another process holds it, or another study has come into it; ResultsError if it cannot be written.
        """
        try:
            (self.folder / "shards").mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise ResultsError(f"cannot write to {self.folder}: {error.strerror}; choose another --out") from error
        busy = StudyError(f"another process is running the study in {self.folder}: wait for it, or stop it")
        with locked(self.folder, busy):
            if (self.folder / "study.toml").exists():
                self._require_same()
            else:
                replace_own(self.folder / "study.toml", tomli_w.dumps(self.study.content))
            for left in (self.folder / "shards").glob(".runs-*"):  # by a process that was killed
                left.unlink(missing_ok=True)
            yield

    def shards(self) -> list[Path]:
        """Return the files of the finished shards, in the order of their runs."""
        return sorted((self.folder / "shards").glob("runs-*.parquet"))

    def missing(self, shard: int | Callable[[], int]) -> Iterator[range]:
        """Yield the runs that no finished shard holds, at most `shard` at a time and all of one point of the grid."""
        most = shard if callable(shard) else lambda: shard
        next_run, size = 0, self.study.size
        for done in [*map(runs_of, self.shards()), range(size, size)]:
            while next_run < done.start:
                end = min(done.start, next_run + most(), (next_run // self.study.seeds + 1) * self.study.seeds)
                yield range(next_run, end)
                next_run = end
            next_run = max(next_run, done.stop)

    def write(self, runs: range, shard: Shard) -> None:
        """Write a finished shard, whole or not at all: beside, and then renamed; raise ResultsError if that fails."""
        folder, study = self.folder / "shards", self.study
        path = folder / f"runs-{runs[0]:010}-{runs[-1]:010}.parquet"
        beside = path.with_name(f".{path.name}.{os.getpid()}")
        metadata = {"fingerprint": study.fingerprint, "versions": json.dumps(versions()), "seconds": json.dumps(shard.seconds)}
        try:
            pq.write_table(pa.Table.from_pylist(shard.rows, schema=_schema(study).with_metadata(metadata)), beside)
            with beside.open("rb+") as file:
                os.fsync(file.fileno())
            beside.replace(path)
        except OSError as error:
            raise ResultsError(
                f"cannot write to {folder}: {error.strerror or error}; make room and go on with --resume"
            ) from error
        finally:
            beside.unlink(missing_ok=True)

    def table(self) -> pa.Table:
        """Return the rows of all finished shards, by run, method and model."""
        return pa.concat_tables([read_shard(path) for path in self.shards()])

    def rows_of(self, run: int) -> list[dict[str, Any]]:
        """Return the rows of a run, none if its shard is not finished."""
        found = [read_shard(path, run).to_pylist() for path in self.shards() if run in runs_of(path)]
        return found[0] if found else []

    def seconds(self) -> dict[str, float]:
        """Time of simulation and of each method, summed over the finished shards [s]."""
        total: dict[str, float] = {}
        for path in self.shards():
            for what, seconds in json.loads(shard_header(path)["seconds"]).items():
                total[what] = total.get(what, 0.0) + seconds
        return total

    def _require_same(self) -> None:
        if _read(self.folder).fingerprint != self.study.fingerprint:
            raise StudyError(f"{self.folder} holds another study, or this one before it was changed: choose another --out")


def _read(folder: Path) -> Study:
    return study_from(read_toml(folder / "study.toml", "study", StudyError), f"{folder / 'study.toml'}")
