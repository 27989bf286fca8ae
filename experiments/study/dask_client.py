"""Dask workers, of this machine or of a scheduler's."""

import logging
import signal
import sys
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from typing import TYPE_CHECKING

from idbench.experiments.errors import StudyError
from idbench.experiments.study.versions import require_versions, versions

if TYPE_CHECKING:
    from distributed import Client

PATIENCE = 10.0
"""How long [s] a scheduler may take to answer, and workers may be away before it is said."""

QUIET = {
    "distributed.worker.profile.enabled": False,
    "distributed.admin.tick.interval": "5s",
    "distributed.admin.system-monitor.interval": "10s",
}
"""What Dask's workers on this machine leave: each look at their own threads stops the simulation for a moment, 6 % in all."""


@contextmanager
def connected(scheduler: str | None, workers: int, then: str) -> Iterator["Client"]:
    """Give a client of a scheduler, or of as many new processes of this machine.

    Parameters
    ----------
    scheduler : str, optional
        Its address.
    workers : int
        Processes, where no scheduler is given.
    then : str
        What to do if the workers are lost.

    Raises
    ------
    StudyError
        If Dask is not installed, the scheduler cannot be reached, or the workers are lost.
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
            yield client
        except (CancelledError, KilledWorker, CommClosedError, TimeoutError) as error:
            said = " ".join(str(error).split())[:200]
            what = f"the workers are lost ({type(error).__name__}: {said})" if said else "the scheduler or all workers are gone"
            raise StudyError(f"{what}: what is finished is kept, {then}") from error


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
