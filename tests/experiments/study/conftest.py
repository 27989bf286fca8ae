"""A study of a second: 2 combinations of 9 runs, each identified 2 times."""

import tomllib
from contextlib import nullcontext

import pytest

from idbench.experiments.cli import main
from idbench.experiments.study.job import local_pool, run_missing
from idbench.experiments.study.store import Store
from idbench.experiments.study.study_file import study_from

TOML = """
name = "small"
question = "Does it work?"
scenario = "ideal"
seeds = 9
models = ["explicit", "power"]

[settings]
encoder = { kind = "incremental" }
torque = { noise = [0.1, 0.01] }

[settings.trajectory]
kind = "random"
moves = 3
durations = [0.9, 1.3]
rest = 0.6

[[axes]]
field = "encoder.lines"
values = [2048, 65536]

[[axes]]
field = "chain.operator.cutoff"
values = [4.0, 5.0]
"""


@pytest.fixture
def content():
    return tomllib.loads(TOML)


@pytest.fixture(scope="session")
def small():
    return study_from(tomllib.loads(TOML), "study")


@pytest.fixture
def file(tmp_path):
    path = tmp_path / "small.toml"
    path.write_text(TOML)
    return path


def run(study, folder, shard=64, threads=2, pool=None):
    """Run a study in this process; return its store."""
    store = Store.new(study, folder)
    with store.held(), nullcontext(pool) if pool else local_pool(study, threads) as place:
        run_missing(store, place, shard, lambda done: None)
    return store


@pytest.fixture(scope="session")
def undisturbed(tmp_path_factory):
    """The rows of the study, all in one go."""
    return run(study_from(tomllib.loads(TOML), "study"), tmp_path_factory.mktemp("undisturbed")).table()


@pytest.fixture
def run_study():
    return run


@pytest.fixture(scope="session")
def done(tmp_path_factory):
    """The folder of the study, run from the command line."""
    folder = tmp_path_factory.mktemp("done")
    (folder / "small.toml").write_text(TOML)
    assert main(["study", str(folder / "small.toml"), "--out", str(folder / "out")]) == 0
    return folder / "out"
