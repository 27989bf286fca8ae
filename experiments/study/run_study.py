"""Running a study: shards in parallel, each written when it is done."""

import threading
from collections.abc import Callable, Mapping
from concurrent.futures import FIRST_COMPLETED, Executor, Future, ThreadPoolExecutor, wait
from contextlib import closing
from typing import Any, Generic, TypeVar

from threadpoolctl import threadpool_limits

from idbench.experiments.errors import StudyError
from idbench.experiments.study.shard import Shard, run_shard
from idbench.experiments.study.store import Store
from idbench.experiments.study.study import Study
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
    size = min(shard, FIRST)
    todo = store.missing(lambda: size)
    pending = dict[Future[Shard], range]()
    done = 0
    while True:
        while len(pending) < 2 * pool.width and (runs := next(todo, None)) is not None:
            pending[pool.submit(runs)] = runs
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
