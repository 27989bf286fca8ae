"""A set of simulated logs: a SCARA whose motions two logs fit, and a third is held out."""

from dataclasses import replace

import pytest

from idbench.identify.files.log_file import write_log
from idbench.sim.engine.simulation import simulate
from idbench.sim.scenario.scenario_file import load
from idbench.sim.trajectories import RandomMoves

DEFINITION = """
title = "A SCARA"
fit = ["one.parquet", "two.parquet"]
held_out = ["new.parquet"]
identify = {robot = "scara", model = "explicit"}
"""


@pytest.fixture(scope="session")
def scara_logs():
    """Three logs of a SCARA with torque noise."""
    plain = load("ideal")
    found = []
    for seed in range(3):
        moves = RandomMoves(moves=10, durations=(0.8, 1.4), rest=0.3, seed=seed)
        noisy = replace(plain.torque, noise=(0.05, 0.02))
        found.append(simulate(replace(plain, trajectory=moves, torque=noisy, seed=seed)).alone())
    return found


@pytest.fixture
def scara_set(tmp_path, scara_logs):
    """The folder of the set."""
    folder = tmp_path / "arm"
    folder.mkdir()
    for name, log in zip(("one", "two", "new"), scara_logs, strict=True):
        write_log(log, folder / f"{name}.parquet")
    (folder / "benchmark.toml").write_text(DEFINITION)
    return folder
