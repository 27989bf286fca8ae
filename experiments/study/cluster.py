"""Running the shards of a study on Dask workers: of this machine, or of many."""

import json
import logging
import signal
import sys
import time
from collections.abc import Iterator
from concurrent.futures import Future
from contextlib import ExitStack, contextmanager
from functools import cache, lru_cache
from importlib.metadata import version
from typing import TYPE_CHECKING

from threadpoolctl import threadpool_limits

from idbench.experiments.errors import StudyError
from idbench.experiments.study.shard import Shard, run_shard
from idbench.experiments.study.study import Study
from idbench.experiments.study.study_file import study_from

if TYPE_CHECKING:
    from distributed import Client


@cache
def versions() -> dict[str, str]:
    """Return the versions of the packages on which the bits of a result depend."""
    return {name: version(name) for name in ("idbench", "mujoco", "numpy", "scipy", "ruckig")}


def require_versions(theirs: dict[str, str], whose: str) -> None:
    """Raise StudyError if the versions of another place are not those of this process."""
    other = [f"{name} {theirs.get(name)} (here {here})" for name, here in versions().items() if theirs.get(name) != here]
    if other:
        raise StudyError(f"{whose} has {', '.join(other)}: the same study needs the same versions everywhere")


PATIENCE = 10.0  # How long [s] a scheduler may take to answer, and workers may be away before it is said

QUIET = {
    "distributed.worker.profile.enabled": False,
    "distributed.admin.tick.interval": "5s",
    "distributed.admin.system-monitor.interval": "10s",
}
"""What Dask's workers on this machine leave: each look at their own threads stops the simulation for a moment, 6 % in all."""


@contextmanager
def cluster_pool(study: Study, scheduler: str | None, workers: int) -> Iterator["ClusterPool"]:
    """Give the workers of the scheduler at an address, or else of as many new processes of this machine.

    StudyError if Dask is not installed, the scheduler cannot be reached, or the workers are lost.
    """
    try:
        import dask
        from distributed import CancelledError, Client, KilledWorker, LocalCluster
        from distributed.comm.core import CommClosedError
    except ImportError as error:
        raise StudyError(
            "work on workers needs Dask: install the extra, as in uv sync --extra cluster, or pip install 'idbench[cluster]'"
        ) from error
    for name in ("distributed", *(name for name in logging.root.manager.loggerDict if name.startswith("distributed."))):
        logging.getLogger(name).setLevel(logging.CRITICAL)  # what goes wrong we say ourselves, in one line; each has its own
    with ExitStack() as stack:
        if scheduler is None:
            options = {"host": "127.0.0.1", "dashboard_address": "127.0.0.1:0", "silence_logs": logging.CRITICAL}
            with _deaf(), dask.config.set(QUIET):
                address = stack.enter_context(
                    LocalCluster(n_workers=workers, threads_per_worker=1, memory_limit=None, **options)
                )
        else:
            address = scheduler
        try:
            client = stack.enter_context(Client(address, timeout=PATIENCE))
        except (OSError, ValueError, TimeoutError) as error:
            raise StudyError(f"cannot reach the scheduler {scheduler}: {error}") from error
        _require_workers(client)
        try:
            yield ClusterPool(study, client)
        except (CancelledError, KilledWorker, CommClosedError, TimeoutError) as error:
            said = " ".join(str(error).split())[:200]
            what = f"the workers are lost ({type(error).__name__}: {said})" if said else "the scheduler or all workers are gone"
            raise StudyError(f"{what}: what is finished is kept, go on with --resume") from error


def _require_workers(client: "Client") -> None:
    """Wait for a first worker, and raise StudyError if the workers are not as this process is."""
    if not client.nthreads():
        sys.stderr.write("idbench: the scheduler has no workers yet; waiting for the first\n")
        client.wait_for_workers(1)
    try:
        for worker, theirs in client.run(ready).items():
            require_versions(theirs, f"worker {worker}")
    except (ModuleNotFoundError, AttributeError) as error:
        raise StudyError(f"the workers have no idbench, or another version of it: {error}") from error


@contextmanager
def _deaf() -> Iterator[None]:
    """Let processes that begin meanwhile not receive Ctrl-C, which a terminal sends to all: this one tells them to end."""
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)


def ready() -> dict[str, str]:
    """Return the versions of a worker, which has loaded all that it needs when it answers."""
    return versions()


DESERTED = 600.0  # How long [s] a study waits for workers when all have gone


class ClusterPool:
    """Shards on the workers of a Dask cluster, each on one thread; a lost worker's shards go to others."""

    def __init__(self, study: Study, client: "Client") -> None:
        self._study, self._client = study, client
        self._pool = client.get_executor(pure=False)
        self._seen, self._told = time.monotonic(), False

    @property
    def width(self) -> int:
        """Number of threads of all workers; new workers count when they have come."""
        return max(1, sum(self._client.nthreads().values()))

    def submit(self, runs: range) -> Future[Shard]:
        """Begin a shard."""
        future: Future[Shard] = self._pool.submit(compute, self._study.text, runs.start, runs.stop, versions())
        return future

    def partial(self) -> float:
        """Return 0: how far a worker is in a shard is not known.

        Say when all workers have gone, and when one is back; raise StudyError if none comes.
        """
        away = time.monotonic() - self._seen
        if sum(self._client.nthreads().values()):
            if self._told:
                sys.stderr.write("idbench: a worker is there: the study goes on\n")
            self._seen, self._told = time.monotonic(), False
        elif away > DESERTED:
            raise StudyError(
                f"all workers are gone for {away:.0f} s: what is finished is kept, start some and go on with --resume"
            )
        elif away > PATIENCE and not self._told:
            self._told = True
            sys.stderr.write(
                f"idbench: all workers are gone; waiting {DESERTED:.0f} s for new ones; Ctrl-C keeps what there is\n"
            )
        return 0.0


def compute(text: str, first: int, stop: int, theirs: dict[str, str]) -> Shard:
    """Return a shard, on a worker; raise StudyError if its versions are not those of the process that asks."""
    require_versions(theirs, "the process that runs the study")
    threadpool_limits(1)  # for good: the process is a worker's, and its other threads compute shards, too
    return run_shard(_study(text), range(first, stop))


@lru_cache(maxsize=2)
def _study(text: str) -> Study:
    return study_from(json.loads(text), "study")
