"""The job `study`: a request becomes the store of a study, and what computes the runs that it lacks."""

import os
from contextlib import AbstractContextManager, nullcontext
from dataclasses import replace
from math import ceil
from pathlib import Path
from typing import Any

from idbench.experiments.errors import StudyError
from idbench.experiments.requests.jobs import StudyRequest
from idbench.experiments.study.run_study import local_pool
from idbench.experiments.study.store import Store
from idbench.experiments.study.study_file import load_study

MANY = 100_000  # Runs beyond which a study is taken for a slip unless it is said to be meant: days of a machine
LARGEST_SHARD = 64  # Runs that are simulated together at most


def store_of(asked: StudyRequest, out: Path | None = None, *, many: bool = False) -> Store:
    """Return the store of a study: a new one in the folder `out`, or that which is to be resumed.

    StudyError, ExperimentError or BenchError if something is wrong with the request, or very many runs are not meant (`many`).
    """
    for name in ("seeds", "shard", "threads", "workers"):
        value = getattr(asked, name)
        if value is not None and value < 1:
            raise StudyError(f"--{name} {value} must be at least 1")
    if asked.resume is not None:
        return _resumed(asked.resume, asked.study, out, asked.seeds)
    return _begun(str(asked.study), out, asked.seeds, many)


def width_of(asked: StudyRequest) -> int:
    """Number of shards at a time."""
    return asked.workers or asked.threads or os.cpu_count() or 1


def runs_of_shard(asked: StudyRequest, store: Store) -> int:
    """Number of runs that are simulated together."""
    return asked.shard or min(LARGEST_SHARD, ceil(store.study.size / (2 * width_of(asked))))


def worker_pool(asked: StudyRequest, store: Store) -> AbstractContextManager[Any]:
    """Context of the pool that computes shards; without a pool if nothing is missing."""
    from idbench.experiments.study.cluster import cluster_pool

    given = [f"--{what}" for what in ("scheduler", "workers", "threads") if getattr(asked, what)]
    if len(given) > 1:
        raise StudyError(f"{', '.join(given)} name several places to run: give one")
    if next(store.missing(1), None) is None:
        return nullcontext()
    if asked.scheduler or asked.workers:
        return cluster_pool(store.study, asked.scheduler, width_of(asked))
    return local_pool(store.study, width_of(asked))


def _begun(name: str, out: Path | None, seeds: int | None, many: bool) -> Store:
    described = load_study(name) if seeds is None else replace(load_study(name), seeds=seeds)
    if described.size > MANY and not many:
        raise StudyError(f"{name} has {described.size:,} runs, more than {MANY:,}: if you mean it, add --yes")
    _ = described.points  # every combination is looked at before the first is run
    return Store.new(described, out or Path("runs") / described.name)


def _resumed(folder: Path, name: str | None, out: Path | None, seeds: int | None) -> Store:
    given = [f"--{what}" for what, value in (("out", out), ("seeds", seeds)) if value is not None]
    if name is not None or given:
        raise StudyError(
            f"--resume {folder} goes on with the study of that folder: leave out {', '.join(filter(None, [name, *given]))}"
        )
    return Store.open(folder)
