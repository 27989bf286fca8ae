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
def load_robot(tmp_path):
    """Return what reads a robot out of the text of a file."""

    def read(text, *edits, name="arm.urdf"):
        (tmp_path / name).write_text(text)
        return Robot.load(str(tmp_path / name), *edits)

    return read
