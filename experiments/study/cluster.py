"""Running the shards of a study on Dask workers: of this machine, or of many."""

import sys
import time
from collections.abc import Iterator
from concurrent.futures import Future
from contextlib import contextmanager
from functools import lru_cache
from typing import TYPE_CHECKING

from threadpoolctl import threadpool_limits

from idbench.experiments.errors import StudyError
from idbench.experiments.study.dask_client import PATIENCE, connected
from idbench.experiments.study.shard import Shard, run_shard
from idbench.experiments.study.study import Study
from idbench.experiments.study.study_file import study_from_text
from idbench.experiments.study.versions import require_versions, versions

if TYPE_CHECKING:
    from distributed import Client

DESERTED = 600.0
"""How long [s] a study waits for workers when all have gone."""


class ClusterPool:
    """Shards on the workers of a Dask cluster, each on one thread; a lost worker's shards go to others.

    Parameters
    ----------
    study : Study
        What to run.
    client : distributed.Client
        The cluster.
    """

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
        """Return 0: how far a worker is in a shard is not known; raise StudyError if no worker has been there for long."""
        self._look(sum(self._client.nthreads().values()))
        return 0.0

    def _look(self, threads: int) -> None:
        """Say when all workers have gone, and when one is back; raise StudyError if none comes."""
        away = time.monotonic() - self._seen
        if threads:
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


@contextmanager
def cluster_pool(study: Study, scheduler: str | None, workers: int) -> Iterator[ClusterPool]:
    """Give the workers of a scheduler, or without one as many new processes of this machine; raise StudyError."""
    with connected(scheduler, workers, "go on with --resume") as client:
        yield ClusterPool(study, client)


def compute(text: str, first: int, stop: int, theirs: dict[str, str]) -> Shard:
    """Return a shard, on a worker; raise StudyError if its versions are not those of the process that asks."""
    require_versions(theirs, "the process that runs the study")
    threadpool_limits(1)  # for good: the process is a worker's, and its other threads compute shards, too
    return run_shard(_study(text), range(first, stop))


@lru_cache(maxsize=2)
def _study(text: str) -> Study:
    return study_from_text(text)
