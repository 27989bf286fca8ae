"""The simulation: robots, trajectories and the logs that a robot would record. The only place for MuJoCo and ruckig.

from idbench.sim import load_robot, load_scenario, run

simulated = run(load_scenario("quantization"), seeds=range(3))  # .log, and the true .q, .qd, .tau
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from idbench.sim.engine.run import Run as Run
    from idbench.sim.engine.simulation import simulate as run
    from idbench.sim.robot.robot import Robot as Robot
    from idbench.sim.robot.tree import kinematic_tree as kinematic_tree
    from idbench.sim.scenario.scenario import Scenario as Scenario
    from idbench.sim.scenario.scenario_file import load as load_scenario

    load_robot = Robot.load

PLACES = {
    "Run": ("idbench.sim.engine.run", "Run"),
    "run": ("idbench.sim.engine.simulation", "simulate"),
    "Robot": ("idbench.sim.robot.robot", "Robot"),
    "load_robot": ("idbench.sim.robot.robot", "Robot.load"),
    "kinematic_tree": ("idbench.sim.robot.tree", "kinematic_tree"),
    "Scenario": ("idbench.sim.scenario.scenario", "Scenario"),
    "load_scenario": ("idbench.sim.scenario.scenario_file", "load"),
}
"""Where the names of this package are: MuJoCo is loaded when one is first asked for, not with every module beside it."""

__all__ = ["Robot", "Run", "Scenario", "kinematic_tree", "load_robot", "load_scenario", "run"]


def __dir__() -> list[str]:
    return __all__


def __getattr__(name: str) -> Any:
    if name not in PLACES:
        raise AttributeError(f"module 'sim' has no {name!r}; it has {', '.join(PLACES)}")
    module, path = PLACES[name]
    found: Any = import_module(module)
    for part in path.split("."):
        found = getattr(found, part)
    return found
