"""The jobs `table1` and `table2`: a request becomes the paper's comparison, or its experiment."""

from collections.abc import Callable

from idbench.experiments.errors import ExperimentError
from idbench.experiments.paper.search import TrajectorySearch
from idbench.experiments.paper.table1 import CHAINS_COMPARED, SCENARIO, Table1
from idbench.experiments.paper.table2 import Table2
from idbench.experiments.requests.jobs import Table1Request, Table2Request
from idbench.sim.engine.watch import Watch
from idbench.sim.robot.robot import Robot
from idbench.sim.scenario.scenario import Scenario
from idbench.sim.scenario.scenario_file import load

Searching = Callable[[int, float], None]
"""Hears the round of a search, and how far it is from the paper's condition numbers."""


def table1_of(asked: Table1Request, searching: Searching | None = None) -> Table1:
    """Return the paper's simulation comparison.

    Raises
    ------
    ExperimentError, IdentificationError, BenchError
        If something is wrong with the request.
    """
    if asked.seed is not None and asked.scenario is not None:
        raise ExperimentError(f"--seed {asked.seed} and --scenario {asked.scenario} name two trajectories: give one")
    chains = CHAINS_COMPARED if asked.chain == "all" else (asked.chain,)
    return Table1(
        load(asked.scenario or SCENARIO) if asked.seed is None else searched(asked.seed, searching or (lambda *_: None)), chains
    )


def table2_of(asked: Table2Request, progress: Callable[[float], None], watch: Watch | None = None) -> Table2:
    """Return the paper's experiment on the virtual robot, to be closed by the caller."""
    return Table2(load(asked.scenario), progress, watch)


def searched(seed: int, searching: Searching) -> Scenario:
    """Return a scenario whose trajectory has the paper's condition numbers."""
    return TrajectorySearch(seed=seed).run(Robot.load("scara"), searching)
