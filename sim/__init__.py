"""The simulation: robots, trajectories and the logs that a robot would record. The only place for MuJoCo and ruckig.

from sim import load_robot, load_scenario, run

simulated = run(load_scenario("quantization"), seeds=range(3))  # .log, and the true .q, .qd, .tau
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from sim.engine.run import Run as Run
    from sim.engine.simulation import simulate as run
    from sim.robot.robot import Robot as Robot
    from sim.robot.tree import kinematic_tree as kinematic_tree
    from sim.scenario.scenario import Scenario as Scenario
    from sim.scenario.scenario_file import load as load_scenario

    load_robot = Robot.load

PLACES = {
    "Run": ("sim.engine.run", "Run"),
    "run": ("sim.engine.simulation", "simulate"),
    "Robot": ("sim.robot.robot", "Robot"),
    "load_robot": ("sim.robot.robot", "Robot.load"),
    "kinematic_tree": ("sim.robot.tree", "kinematic_tree"),
    "Scenario": ("sim.scenario.scenario", "Scenario"),
    "load_scenario": ("sim.scenario.scenario_file", "load"),
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
