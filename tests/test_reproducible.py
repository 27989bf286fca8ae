"""Same seed, same bits: whatever the number of threads that BLAS and MuJoCo may use."""

import subprocess
import sys

import pytest

CODE = """
import hashlib
from experiments.table1 import SCENARIO, Table1
from sim.scenario import Scenario
table = Table1(Scenario.load(SCENARIO), ("paper", "idbench"))
digest = hashlib.sha256(table.log.tau.tobytes())
for estimates in table.estimates.values():
    for estimate in estimates.values():
        for array in (estimate.system.Y, estimate.system.W, estimate.X, estimate.covariance):
            digest.update(array.tobytes())
print(digest.hexdigest())
"""


@pytest.mark.parametrize("threads", ["1", "3"])
def test_threads_change_no_bit(threads, monkeypatch):
    def digest():
        return subprocess.run([sys.executable, "-c", CODE], capture_output=True, text=True, check=True).stdout

    default = digest()
    monkeypatch.setenv("OPENBLAS_NUM_THREADS", threads)
    assert digest() == default
