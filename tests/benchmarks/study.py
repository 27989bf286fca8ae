"""A study of 1000 runs of 40 s, three models each, against bare native `mj_step` for the same physics steps.

    uv run --extra cluster python tests/benchmarks/study.py [RUNS] [MOVES]

Averaged drive, 14- and 16-bit encoders, PD loop at 100 Hz, every run with a motion of its own. Both take the same threads; half
of the bare steps come before the study and half after, so that the ratio holds when the machine's speed drifts. Then 256 runs
on two worker processes; their start is given separately. Peak memory is that of this process.
"""

import resource
import sys
import tempfile
import time
from pathlib import Path

from timing import bare

from idbench.experiments.recording.study_recording import StudyRecording
from idbench.experiments.results.folder import ResultsFolder
from idbench.experiments.results.page import Page
from idbench.experiments.study.cluster import cluster_pool
from idbench.experiments.study.job import local_pool, run_missing
from idbench.experiments.study.store import Store
from idbench.experiments.study.study import Study
from idbench.experiments.study.study_file import study_from
from idbench.experiments.study.study_results import write_results

RUNS = int(sys.argv[1]) if len(sys.argv) > 1 else 1000
MOVES = int(sys.argv[2]) if len(sys.argv) > 2 else 29
SHARD, THREADS = 64, 2


def study(runs: int) -> Study:
    """Return a study of `runs` runs in two combinations, 40 s each."""
    trajectory = {"kind": "random", "moves": MOVES, "durations": [1.3, 1.3], "rest": 1.15}
    settings = {"trajectory": trajectory, "drive": {"kind": "averaged"}, "encoder": {"kind": "incremental"}}
    axes = [{"field": "encoder.lines", "values": [4096, 16384]}]
    content = {"name": "benchmark", "question": "How fast?", "scenario": "ideal", "seeds": runs // 2, "axes": axes}
    return study_from({**content, "settings": settings}, "study")


def native(described: Study, runs: int) -> float:
    """Return how long bare steps of as many simulations take [s]."""
    scenario = described.scenario_of(0)
    steps = round(scenario.trajectory.plan(scenario.nominal_robot).duration / 0.001)
    return bare(scenario, 0.001, steps, runs, THREADS)


def timed(runs: int, workers: int, report: bool) -> tuple[float, float]:
    """Return how long a study takes, and bare steps before and after it [s]."""
    described = study(runs)
    before = native(described, runs // 2)
    with tempfile.TemporaryDirectory() as folder:
        start = time.perf_counter()
        store = Store.new(described, Path(folder) / "out")
        with cluster_pool(described, None, workers) if workers else local_pool(described, THREADS) as pool, store.held():
            up = time.perf_counter() - start
            run_missing(store, pool, SHARD, lambda done: None)
            took = time.perf_counter() - start - up
        if report:
            results = ResultsFolder(store.folder, "study", "benchmark")
            write_results(Page(), store, results, StudyRecording(described, store.folder, None))
            print(f"  report, recording and summary: {time.perf_counter() - start - took - up:.1f} s more")
        seconds = store.seconds()
        print(f"  start {up:.1f} s, not in the ratio below")
        print(f"  {', '.join(f'{what} {s:.1f} s' for what, s in seconds.items())} of the threads' time")
    return took, before + native(described, runs - runs // 2)


def main() -> None:
    """Print both ratios."""
    for runs, workers in ((RUNS, 0), (RUNS if RUNS < 256 else 256, 2)):
        where = f"{workers} worker processes" if workers else f"{THREADS} threads"
        print(f"{runs} runs on {where}:")
        took, steps = timed(runs, workers, not workers)
        memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
        print(f"  {took:.1f} s, bare steps {steps:.1f} s, ratio {took / steps:.3f}; peak memory {memory:.0f} MB")


if __name__ == "__main__":
    main()
