"""Same seed, same bits: whatever the number of threads that BLAS may use, and of processors that MuJoCo finds.

At 1 kHz, where matrices and batches are large enough to be shared between threads.
"""

import os
import subprocess
import sys

import pytest

CODE = """
import hashlib, os, sys
if sys.argv[1] == "1":
    os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})
from idbench.experiments.paper.table1 import SCENARIO, Table1
from idbench.sim.scenario.scenario_file import load
from dataclasses import replace
table = Table1(replace(load(SCENARIO), fs=1000.0), ("paper", "idbench"))
digest = hashlib.sha256(table.log.tau.tobytes())
for estimates in table.estimates.values():
    for estimate in estimates.values():
        for array in (estimate.rows.Y, estimate.rows.W, estimate.X, estimate.covariance):
            digest.update(array.tobytes())
print(digest.hexdigest())
"""


@pytest.mark.thorough
@pytest.mark.parametrize("threads", ["1", "3"])
@pytest.mark.skipif(not hasattr(os, "sched_setaffinity"), reason="processors cannot be chosen here")
def test_threads_change_no_bit(threads, monkeypatch):
    def digest(processors):
        return subprocess.run([sys.executable, "-c", CODE, processors], capture_output=True, text=True, check=True).stdout

    default = digest("all")
    monkeypatch.setenv("OPENBLAS_NUM_THREADS", threads)
    assert digest(threads) == default
