"""What many tests start from."""

import importlib.util
import os
import shutil
import signal
import site
import subprocess
import sys
import sysconfig
from dataclasses import replace
from pathlib import Path

NEEDED = (
    "pinocchio",
    "covertable",
    "distributed",
    "dask_jobqueue",
    "rosbags",
    "sympy",
    "yaml",
    *(("pydrake",) if sys.platform == "linux" else ()),
)
"""Modules of the dependency group `test`, which `uv run idbench` does not install: Drake and robots of others, 400 MB."""

if any(importlib.util.find_spec(name) is None for name in NEEDED):
    if not (uv := os.environ.get("UV") or shutil.which("uv")):
        sys.exit("the tests need the dependency group test: uv sync --group test, or pip install --group test")
    subprocess.run([uv, "sync", "--inexact", "--group", "test"], cwd=Path(__file__).parent.parent, check=True)
    sys.modules.pop("cmeel_pth", None)  # a process of xdist has run it, and then got the search path of before
    site.addsitedir(sysconfig.get_path("purelib"))  # what has come adds itself to the search path as at the start of Python

os.environ.setdefault("RUST_LOG", "off")  # as on the command line: read when rerun is loaded, which tests do first
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # as there

# Python keeps what it has compiled: the tests start it a hundred times, on some machines with this switched off.
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
os.environ.setdefault("PYTHONPYCACHEPREFIX", str(Path(__file__).parent.parent / ".pytest_cache" / "compiled"))

if (worker := os.environ.get("PYTEST_XDIST_WORKER")) and hasattr(os, "sched_setaffinity"):
    # One processor at a time for each process of tests, and for what it starts: threads of MuJoCo hinder each other.
    every = sorted(os.sched_getaffinity(0))
    os.sched_setaffinity(0, {every[int(worker.removeprefix("gw")) % len(every)]})

import numpy as np
import pytest

from idbench.experiments.paper.table1 import CHAINS_COMPARED, SCENARIO, Table1
from idbench.identify import MotionLog
from idbench.identify.files.log_file import write_log
from idbench.sim.engine.run import ideal_log
from idbench.sim.engine.simulation import simulate
from idbench.sim.robot.robot import Robot
from idbench.sim.scenario.scenario_file import load

X = np.array([3.5, 0.05, 0.5, 0.06, 0.12, 0.005, 0.01, 0.1])
"""The paper's supposed true values (section 7.2), typed here and nowhere else: ZZR1 Fv1 Fs1 ZZ2 LMX2 LMY2 Fv2 Fs2."""


def pytest_xdist_auto_num_workers() -> int:
    """Return one process more than processors: one of them waits, for a viewer or a process that it started."""
    return len(os.sched_getaffinity(0) if hasattr(os, "sched_getaffinity") else range(os.cpu_count() or 1)) + 1


def pytest_addoption(parser: pytest.Parser) -> None:
    """Let a test write what the pages show, instead of holding it against that."""
    parser.addoption("--write-results", action="store_true", help="write what is measured into docs/results")


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
    return Table1(load(SCENARIO), CHAINS_COMPARED)


@pytest.fixture(scope="session")
def log(robot: Robot) -> MotionLog:
    """Ideal data of a motion at which every instant of some rows is masked, and torques are large."""
    return ideal_log(robot, load("brisk").trajectory.sample(robot, 100.0))


@pytest.fixture(scope="session")
def logs(tmp_path_factory):
    """Return a folder with two logs of the PUMA, short ones."""
    folder, arm = tmp_path_factory.mktemp("logs"), load("arm")
    for name, moves, seed in (("first", 12, 0), ("second", 5, 3)):
        trajectory = replace(arm.trajectory, moves=moves, seed=seed)
        log = simulate(replace(arm, robot="puma560", fs=250.0, trajectory=trajectory)).alone()
        write_log(log, folder / f"{name}.parquet")
    return folder


@pytest.fixture(scope="session")
def root() -> Path:
    return Path(__file__).parent.parent


@pytest.fixture
def start():
    """Give what starts a Python process with the signals of a shell's foreground; it ends with the test, whatever happens."""
    processes = []

    def popen(*words, **options):
        options = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True} | options
        processes.append(subprocess.Popen([sys.executable, *words], preexec_fn=_foreground, **options))
        return processes[-1]

    yield popen
    for process in processes:
        process.kill()
        process.communicate()


def _foreground():
    """Let Ctrl-C interrupt: a background job, and what it starts, ignores it."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)
