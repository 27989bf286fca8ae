"""What many tests start from."""

import os
from pathlib import Path

os.environ.setdefault("RUST_LOG", "off")  # as on the command line: read when rerun is loaded, which tests do first

import numpy as np
import pytest

from experiments.table1 import SCENARIO, Table1
from identify import MotionLog
from sim.robot import Robot
from sim.scenario_file import load

X = np.array([3.5, 0.05, 0.5, 0.06, 0.12, 0.005, 0.01, 0.1])
"""The paper's supposed true values (section 7.2), typed here and nowhere else: ZZR1 Fv1 Fs1 ZZ2 LMX2 LMY2 Fv2 Fs2."""


@pytest.fixture(scope="session")
def truth() -> np.ndarray:
    return X.copy()


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(20)


@pytest.fixture(scope="session")
def robot() -> Robot:
    return Robot.load("scara")


@pytest.fixture(scope="session")
def table1() -> Table1:
    return Table1(load(SCENARIO), ("paper", "idbench"))


@pytest.fixture(scope="session")
def log(table1: Table1) -> MotionLog:
    return table1.log


@pytest.fixture(scope="session")
def root() -> Path:
    return Path(__file__).parent.parent
