"""What a contract is made of: examples to try a plug-in with, and complaints that say what is wrong."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from idbench.experiments.errors import ExperimentError
from idbench.experiments.identification.robot_model import RobotModel
from idbench.experiments.identification.simulators import RobotPlant, ScenarioLoop
from idbench.experiments.paper.table1 import SCENARIO, Table1
from idbench.identify import Array, MotionLog, Simulation
from idbench.sim.engine.run import Run
from idbench.sim.engine.simulation import simulate
from idbench.sim.robot.robot import Robot
from idbench.sim.scenario.scenario_file import load
from idbench.sim.trajectories import RandomMoves, Reference

FS = 100.0  # Sampling frequency of the examples [Hz]
RUNS = 3  # Runs, or simulations, of the examples


class ContractError(ExperimentError):
    """A plug-in does not keep its contract."""


@dataclass(frozen=True, eq=False)
class Example:
    """What plug-ins are tried with: the paper's SCARA on noise-free moves, and signals of three runs of two joints."""

    @cached_property
    def _table(self) -> Table1:
        return Table1(load(SCENARIO), ())

    @cached_property
    def log(self) -> MotionLog:
        """A log without noise."""
        return self._table.log

    @cached_property
    def truth(self) -> Array:
        """Its parameters."""
        return np.array(list(self._table.truth.values()))

    @cached_property
    def run(self) -> Run:
        """A closed loop of the SCARA without noise."""
        return simulate(replace(load("ideal"), trajectory=RandomMoves(moves=3, durations=(0.9, 0.9), rest=0.3)))

    @property
    def simulation(self) -> Simulation:
        """What simulates it."""
        loop = ScenarioLoop(RobotModel(), (self.run.scenario,), (self.run.alone(),))
        return Simulation(loop, RobotPlant(RobotModel()))

    @property
    def robot(self) -> Robot:
        """The SCARA."""
        return Robot.load("scara")

    @property
    def reference(self) -> Reference:
        """Its motion."""
        return self._table.reference

    @cached_property
    def t(self) -> Array:
        """Times of the signals [s]."""
        return np.arange(1200) / FS

    @cached_property
    def signals(self) -> Array:
        """Signals, shape (run, joint, time)."""
        return np.stack([np.stack([np.sin(a * self.t), np.cos(b * self.t)]) for a, b in ((1, 2), (3, 1), (2, 5))])


Clause = Callable[[Any, Example], None]
"""A part of a contract: raises if a plug-in does not keep it; its docstring says what it asks."""


def require(kept: object, complaint: str) -> None:
    """Raise ContractError unless something is kept."""
    if not kept:
        raise ContractError(complaint)


def require_equal(found: Any, expected: Any, what: str, rtol: float = 0.0, atol: float = 0.0) -> None:
    """Raise ContractError if arrays differ, saying by how much."""
    found, expected = np.asarray(found), np.asarray(expected)
    if np.shape(found) != np.shape(np.broadcast_to(expected, np.broadcast_shapes(found.shape, expected.shape))):
        raise ContractError(f"{what} has the shape {found.shape}, expected {expected.shape}")
    if not np.allclose(found, expected, rtol=rtol, atol=atol, equal_nan=True):
        with np.errstate(invalid="ignore"):
            off = np.nanmax(np.abs(found - expected)) if np.isfinite(found).any() else np.nan
        raise ContractError(f"{what} is off by up to {off:.3g}")


def untouched(function: Callable[[Array], Array], array: Array) -> Array:
    """Result of a function for a read-only array; raise ContractError if it is not the same bits twice."""
    array.setflags(write=False)
    first, second = function(array), function(array)
    require_equal(first, second, "the result of a second call")
    return first
