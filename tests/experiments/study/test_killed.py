"""A study is killed at several instants, and a worker of one: what comes out in the end has not one bit that differs."""

import os
import signal
import time

import pytest

from idbench.experiments.study.cluster import cluster_pool
from idbench.experiments.study.run_study import local_pool, run_missing
from idbench.experiments.study.store import Store

CODE = """
import sys
import time
from pathlib import Path
from idbench.experiments.study.run_study import local_pool, run_missing
from idbench.experiments.study.store import Store
store = Store.open(Path(sys.argv[1]))
with local_pool(store.study, 2) as pool:
    run_missing(store, pool, 2, lambda done: time.sleep(0.05))  # time for the kill, whatever else the machine does
"""


def finished(folder):
    return {path.name: path.read_bytes() for path in (folder / "shards").glob("runs-*")}


@pytest.mark.thorough
@pytest.mark.parametrize("shards", [3])
def test_a_kill_loses_no_finished_shard(small, tmp_path, undisturbed, shards, start):
    """SIGKILL as soon as so many shards are there; what was there stays as it was."""
    with Store.new(small, tmp_path).held():
        pass
    process, begun = start("-c", CODE, str(tmp_path)), time.monotonic()
    while len(finished(tmp_path)) < shards or (not shards and time.monotonic() < begun + 2):
        assert process.poll() is None
        time.sleep(0.001)
    process.kill()
    assert process.wait() == -signal.SIGKILL
    kept = finished(tmp_path)
    assert shards <= len(kept) < 10
    resumed = Store.open(tmp_path)
    with local_pool(small, 2) as pool, resumed.held():
        run_missing(resumed, pool, 64, lambda done: None)
    assert kept.items() <= finished(tmp_path).items()
    assert resumed.table().equals(undisturbed)


@pytest.mark.thorough
def test_a_killed_worker_costs_only_time(small, tmp_path, undisturbed):
    """One of two workers is killed while shards are computed; it is replaced, and its shard is done again."""
    store, killed = Store.new(small, tmp_path), []
    with cluster_pool(small, None, 2) as pool, store.held():

        def watch(done):
            if done and not killed:
                killed.append(next(iter(pool._client.run(os.getpid).values())))
                os.kill(killed[0], signal.SIGKILL)

        run_missing(store, pool, 2, watch)
        assert killed[0] not in pool._client.run(os.getpid).values()
    assert store.table().equals(undisturbed)
