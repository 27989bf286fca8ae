"""The job `study`: a request becomes the store of a study; shards are run in parallel, each written when it is done."""

import os
import threading
from collections.abc import Callable, Mapping
from concurrent.futures import FIRST_COMPLETED, Executor, Future, ThreadPoolExecutor, wait
from contextlib import AbstractContextManager, closing, nullcontext
from dataclasses import replace
from math import ceil
from pathlib import Path
from typing import Any, Generic, TypeVar

from threadpoolctl import threadpool_limits

from idbench.experiments.errors import StudyError
from idbench.experiments.requests.jobs import StudyRequest
from idbench.experiments.study.shard import Shard, run_shard
from idbench.experiments.study.store import Store
from idbench.experiments.study.study import Study
from idbench.experiments.study.study_file import load_study
from idbench.sim.engine.simulation import Progress


def compare_again(store: Store, run: int) -> tuple[list[dict[str, Any]], bool]:
    """Rows of a run, made again alone, and whether the study has it; StudyError if it has other bits, or no such run."""
    store.study.scenario_of(run)
    made, known = run_shard(store.study, range(run, run + 1)).rows, store.rows_of(run)
    for here, there in zip(made, known, strict=bool(known)):
        other = [f"{name} {there[name]!r}, now {here.get(name)!r}" for name in there if not _same(here, there, name)]
        if other:
            what = f"{there['chain']}, {there['estimator']}, {there['model']}"
            raise StudyError(f"run {run} of {store.folder} is not reproduced ({what}): {'; '.join(other[:3])}")
    return made, bool(known)


def _same(here: Mapping[str, Any], there: Mapping[str, Any], name: str) -> bool:
    return bool(here.get(name) == there[name] or (here.get(name) != here.get(name) and there[name] != there[name]))


Part = TypeVar("Part")

FIRST, KEPT = 8, 10.0  # Runs of the first shards at most, and seconds that the others take
POLL = 0.2  # How often [s] the progress is shown while shards are computed


class CancelledError(Exception):
    """Raised inside shards that shall not go on."""


class LocalPool(Generic[Part]):
    """Parts of a work on the threads of this process, such as shards: MuJoCo and NumPy let each other run.

    `compute` makes the part of some numbers, such as those of runs, on one native thread, and tells the share that is done.
    """

    def __init__(self, compute: Callable[[range, Progress], Part], threads: int) -> None:
        self.width = threads
        self._compute = compute
        self._stop = threading.Event()
        self._done = dict[int, float]()
        self._pool: Executor = ThreadPoolExecutor(threads)
        # Shards are the parallel work; a matrix product that forks would only be in their way.
        self._limits = threadpool_limits(1)

    def submit(self, runs: range) -> Future[Part]:
        """Begin a part."""
        return self._pool.submit(self._run, runs)

    def partial(self) -> float:
        """Size of the parts in progress [numbers]."""
        return sum(list(self._done.values()))

    def close(self) -> None:
        """Stop at the next opportunity and wait for it."""
        self._stop.set()
        self._pool.shutdown(cancel_futures=True)
        self._limits.restore_original_limits()

    def _run(self, runs: range) -> Part:
        def receive(share: float) -> None:
            self._done[runs[0]] = share * len(runs)
            if self._stop.is_set():
                raise CancelledError

        try:
            return self._compute(runs, receive)
        finally:
            self._done.pop(runs[0], None)


def local_pool(study: Study, threads: int) -> closing[LocalPool[Shard]]:
    """Context of a pool of threads for the shards of a study."""
    return closing(LocalPool(lambda runs, progress: run_shard(study, runs, progress=progress), threads))


def run_missing(
    store: Store, pool: LocalPool[Shard], shard: int, watch: Progress, finished_shard: Callable[[range], None] | None = None
) -> None:
    """Run what a study lacks, in shards of at most `shard` runs; what is finished when this is interrupted is kept.

    Shards begin small, and are as long as some `KEPT` seconds take, so that an interruption loses no more.
    `watch` receives how many runs of this call are done, parts of shards included; `finished_shard` the runs of every shard
    when it is kept.
    """
    size, left = min(shard, FIRST), sum(map(len, store.missing(shard)))
    todo = store.missing(lambda: max(1, min(size, ceil(left / (2 * pool.width)))))  # short ones at the end: all end together
    pending = dict[Future[Shard], range]()
    done = 0
    while True:
        while len(pending) < 2 * pool.width and (runs := next(todo, None)) is not None:
            pending[pool.submit(runs)] = runs
            left -= len(runs)
        if not pending:
            return
        finished, _ = wait(pending, timeout=POLL, return_when=FIRST_COMPLETED)
        for future in sorted(finished, key=lambda future: future.exception() is not None):  # what is good is kept first
            runs = pending.pop(future)
            store.write(runs, made := future.result())
            size = min(shard, max(1, int(KEPT * len(runs) / max(sum(made.seconds.values()), 1e-3))))
            done += len(runs)
            if finished_shard:
                finished_shard(runs)
        watch(done + pool.partial())


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
        given = [f"--{what}" for what, value in (("out", out), ("seeds", asked.seeds)) if value is not None]
        if asked.study is not None or given:
            others = ", ".join(filter(None, [asked.study, *given]))
            raise StudyError(f"--resume {asked.resume} goes on with the study of that folder: leave out {others}")
        return Store.open(asked.resume)
    described = load_study(str(asked.study))
    described = described if asked.seeds is None else replace(described, seeds=asked.seeds)
    if described.size > MANY and not many:
        raise StudyError(f"{asked.study} has {described.size:,} runs, more than {MANY:,}: if you mean it, add --yes")
    _ = described.points  # every combination is looked at before the first is run
    return Store.new(described, out or Path("runs") / described.name)


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
