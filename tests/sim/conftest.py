"""What the tests of the bench share."""

from dataclasses import replace

import pytest

from idbench.sim.robot.robot import Robot
from idbench.sim.scenario.scenario import Scenario
from idbench.sim.scenario.scenario_file import load
from idbench.sim.trajectories import Quintic

MOVE = Quintic(((0.0, 0.0), (1.2, -1.0), (-0.4, 0.8), (0.6, -0.3)), (0.8, 1.0, 0.9), 0.3)


@pytest.fixture(scope="session")
def ideal() -> Scenario:
    return load("ideal")


@pytest.fixture(scope="session")
def short(ideal: Scenario) -> Scenario:
    """The ideal loop on three moves, 3.3 s."""
    return replace(ideal, trajectory=MOVE)


@pytest.fixture
def written(tmp_path):
    """Return what writes a file of a robot, and gives its path."""

    def write(text, name="arm.xml"):
        path = tmp_path / name
        path.write_text(text)
        return str(path)

    return write


@pytest.fixture
def load_robot(written):
    """Return what reads a robot out of the text of a file."""
    return lambda text, *edits, name="arm.xml": Robot.load(written(text, name), *edits)
