"""Simulated runs with a payload and without it, whose truth is known."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property

from idbench.experiments.identification.robot_model import RobotModel
from idbench.experiments.requests.shared import Parameters
from idbench.identify import Array
from idbench.identify.data.kinematics import INERTIAL
from idbench.identify.loads.loaded_robot import LoadedRobot
from idbench.sim.engine.run import Run
from idbench.sim.engine.simulation import simulate
from idbench.sim.robot.payload import Payload
from idbench.sim.robot.tree import standard_parameters
from idbench.sim.scenario.scenario import Scenario


@dataclass(frozen=True, eq=False)
class Pairs:
    """A scenario with a payload, simulated with and without it; only what is random differs from run to run."""

    scenario: Scenario
    """With the payload."""
    runs: int = 1
    """How many."""

    @cached_property
    def robot_model(self) -> RobotModel:
        """The robot."""
        return RobotModel(self.scenario.robot, Parameters())

    @cached_property
    def simulated(self) -> tuple[Run, Run]:
        """The runs without and with the payload."""
        first = self.scenario.seed
        seeds = range(first, first + self.runs), range(first + self.runs, first + 2 * self.runs)
        bare = replace(self.scenario, payload=Payload())
        return simulate(bare, list(seeds[0])), simulate(self.scenario, list(seeds[1]))

    @cached_property
    def truth(self) -> dict[str, float]:
        """The parameters of the payload."""
        link = self.robot_model.tree.n
        before, after = (standard_parameters(run.robots[0]) for run in self.simulated)
        return {f"{x}L": after[f"{x}{link}"] - before[f"{x}{link}"] for x in INERTIAL}

    def robot(self, run: int, known: Mapping[str, float], gains: Array | float = 1.0) -> LoadedRobot:
        """Return the robot with the logs of a run, currents as if its drives had these gains."""
        logs = (each.alone(run) for each in self.simulated)
        first, second = ((replace(log, tau=log.tau / gains),) for log in logs)
        return LoadedRobot(self.robot_model.tree, self.robot_model.grouping.standard, first, second, known=known)
