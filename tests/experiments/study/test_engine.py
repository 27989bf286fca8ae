"""Running a study: the same bits however it is cut, stopped or killed, and runs that fail by themselves."""

import os
import signal
import time
from concurrent.futures import Future
from types import SimpleNamespace

import pytest
from distributed import LocalCluster
from threadpoolctl import threadpool_info, threadpool_limits

from idbench.experiments.errors import StudyError
from idbench.experiments.study import cluster
from idbench.experiments.study.cluster import cluster_pool, compute, versions
from idbench.experiments.study.job import compare_again, local_pool, run_missing
from idbench.experiments.study.shard import Shard, run_shard
from idbench.experiments.study.store import Store
from idbench.experiments.study.study_file import study_from


@pytest.mark.thorough
@pytest.mark.parametrize(("shard", "threads"), [(1, 2), (7, 1)])
def test_same_bits_whatever_the_shards_and_threads(small, tmp_path, undisturbed, run_study, shard, threads):
    assert run_study(small, tmp_path / "out", shard, threads).table().equals(undisturbed)


@pytest.mark.thorough
@pytest.mark.parametrize("workers", [1, 2])
def test_same_bits_on_any_number_of_workers(small, tmp_path, undisturbed, run_study, workers):
    with cluster_pool(small, None, workers) as pool:
        assert run_study(small, tmp_path / "out", 5, pool=pool).table().equals(undisturbed)


def test_rows_are_those_of_the_study(undisturbed, small):
    rows = undisturbed.to_pylist()
    assert [row["run"] for row in rows[::4]] == list(range(18))
    assert {(row["encoder.lines"], row["chain.operator.cutoff"], row["model"]) for row in rows} == {
        (lines, cutoff, model) for lines in (2048.0, 65536.0) for cutoff in (4.0, 5.0) for model in ("explicit", "power")
    }
    assert all(row["failure"] is None and row["ZZR1.sigma"] > 0 and row["ZZR1.truth"] == pytest.approx(3.5) for row in rows)
    assert {row["seed"] for row in rows} == {small.scenario_of(run).seed for run in range(18)}


@pytest.mark.thorough
def test_a_run_comes_out_again_by_itself(small, tmp_path, run_study):
    store = run_study(small, tmp_path / "out")
    rows, known = compare_again(store, 13)
    assert known
    assert len(rows) == 4


@pytest.mark.thorough
def test_a_run_with_other_bits_is_told(small, tmp_path, run_study, monkeypatch):
    store = run_study(small, tmp_path / "out")
    rows = store.rows_of(13)
    rows[2]["Fv1"] *= 1 + 1e-15
    monkeypatch.setattr(Store, "rows_of", lambda self, run: rows)
    with pytest.raises(StudyError, match=r"run 13 of .* is not reproduced \(idbench, GLS, explicit\): Fv1"):
        compare_again(store, 13)


def test_runs_fail_alone_with_their_reasons(content):
    """A weak drive loses some motions, and one rate is too low for the chain: the rest is as it would be without them."""
    content["settings"]["drive"] = {"kind": "averaged", "current_limit": [4.0, 0.7]}
    content["axes"] = [{"field": "fs", "values": [100.0, 9.0]}]
    study = study_from(content, "study")
    weak, slow = run_shard(study, range(9)).rows, run_shard(study, range(9, 18)).rows
    failed = {row["run"] for row in weak if row["failure"]}
    assert 0 < len(failed) < 9
    assert all("leaves its range" in row["failure"] for row in weak if row["run"] in failed)
    alone = next(run for run in range(9) if run not in failed)
    assert run_shard(study, range(alone, alone + 1)).rows == [row for row in weak if row["run"] == alone]
    assert all(row["failure"] for row in slow)


def test_a_worker_with_another_version_is_refused(small):
    with pytest.raises(StudyError, match=r"has mujoco 1\.0 \(here 4.*: the same study needs the same versions"):
        compute(small.text, 0, 2, versions() | {"mujoco": "1.0"})


def test_workers_with_another_version_are_refused_before_anything_is_run(small, monkeypatch):
    monkeypatch.setattr(cluster, "ready", lambda: {"idbench": "0.0"})
    with pytest.raises(StudyError, match=r"worker tcp.* has idbench 0\.0 \(here "), cluster_pool(small, None, 1):
        pass


def test_and_those_that_come_later_complain_to_the_process_that_asks(small, tmp_path, run_study, monkeypatch):
    with cluster_pool(small, None, 1) as pool:
        monkeypatch.setattr(cluster, "versions", lambda: versions() | {"idbench": "0.0"})
        with pytest.raises(StudyError, match=r"has idbench 0\.0"):
            run_study(small, tmp_path / "out", pool=pool)


@pytest.mark.thorough
def test_a_cluster_that_goes_is_told_in_one_line(small, tmp_path, run_study):
    """The scheduler is closed while the study runs."""

    class Closing:
        width, partial = 2, staticmethod(lambda: 0.0)

        def submit(self, runs):
            future = pool.submit(runs)
            cluster.close()
            return future

    with LocalCluster(n_workers=1, threads_per_worker=1, host="127.0.0.1", dashboard_address="127.0.0.1:0") as cluster:
        address = cluster.scheduler_address
        with (
            pytest.raises(StudyError, match=r"are gone: what is finished is kept, go on with --resume"),
            cluster_pool(small, address, 1) as pool,
        ):
            run_study(small, tmp_path / "out", 64, pool=Closing())


def test_motion_can_be_shared(content):
    study = study_from(content | {"motion": "shared", "seeds": 3}, "study")
    rows = run_shard(study, range(3)).rows
    power = [row for row in rows if row["model"] == "power"]
    assert len({row["condition_number"] for row in power}) == 2  # the two methods'
    assert len({row["ZZR1"] for row in power}) == 6  # the torques' noise is drawn anew


@pytest.mark.thorough
def test_a_study_leaves_the_threads_of_the_libraries_as_they_were(small, tmp_path, run_study):
    """One BLAS thread while it runs, and afterwards as many as before."""
    with threadpool_limits(2):
        before = [pool["num_threads"] for pool in threadpool_info()]
        run_study(small, tmp_path / "out")
        assert [pool["num_threads"] for pool in threadpool_info()] == before


CODE = """
import sys
import time
from concurrent.futures import Future
from types import SimpleNamespace
from pathlib import Path
from idbench.experiments.study.job import local_pool, run_missing
from idbench.experiments.study.store import Store
store = Store.open(Path(sys.argv[1]))
with local_pool(store.study, 2) as pool:
    run_missing(store, pool, 2, lambda done: time.sleep(0.05))  # time for the kill, whatever else the machine does
"""


def finished(folder):
    return {path.name: path.read_bytes() for path in (folder / "shards").glob("runs-*")}


@pytest.mark.thorough
def test_a_kill_loses_no_finished_shard(small, tmp_path, undisturbed, start):
    """SIGKILL as soon as three shards are there; what was there stays as it was."""
    with Store.new(small, tmp_path).held():
        pass
    process = start("-c", CODE, str(tmp_path))
    while len(finished(tmp_path)) < 3:
        assert process.poll() is None
        time.sleep(0.001)
    process.kill()
    assert process.wait() == -signal.SIGKILL
    kept = finished(tmp_path)
    assert 3 <= len(kept) < 10
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


class _Timed:
    """A pool whose shards are done at once, and say that every run took so many seconds."""

    width = 1

    def __init__(self, seconds):
        self.seconds, self.sizes = seconds, []

    def submit(self, runs):
        self.sizes.append(len(runs))
        done = Future()
        done.set_result(Shard([], {"simulation": self.seconds * len(runs)}))
        return done

    def partial(self):
        return 0.0


@pytest.mark.parametrize(("seconds", "expected"), [(1.0, 10), (100.0, 1), (0.001, 64)])
def test_shards_begin_small_and_take_some_ten_seconds(seconds, expected):
    """What an interruption loses is in seconds, whatever a run takes; `shard` is the most."""
    pool, todo = _Timed(seconds), range(1000)

    def missing(size):
        start = 0
        while start < len(todo):
            yield range(start, end := min(start + (size() if callable(size) else size), len(todo)))
            start = end

    store = SimpleNamespace(missing=missing, write=lambda runs, shard: None)
    run_missing(store, pool, 64, lambda done: None)
    assert pool.sizes[0] == 8
    assert pool.sizes[4] == expected == max(pool.sizes[3:])
    assert pool.sizes[-1] == 1  # all end together
    assert sum(pool.sizes) == len(todo)
