"""A MuJoCo testbench for the dynamic identification of robots.

>>> import idbench
>>> run = idbench.simulate("ideal", seed=3)
>>> found = idbench.fit(run.log, run.robot, model="explicit")
>>> sorted(found.parameters) == sorted(run.truth)
True

`idbench.identify` has the mathematics, `idbench.sim` the virtual robots, `idbench.experiments` the jobs, `idbench.models` the
robots that ship.
"""

from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from idbench.experiments.api.calls import fit as fit
    from idbench.experiments.api.calls import load_robot as load_robot
    from idbench.experiments.api.calls import read_log as read_log
    from idbench.experiments.api.calls import simulate as simulate
    from idbench.experiments.api.jobs import StudyTable as StudyTable
    from idbench.experiments.api.jobs import design as design
    from idbench.experiments.api.jobs import fit_gains as fit_gains
    from idbench.experiments.api.jobs import fit_payload as fit_payload
    from idbench.experiments.api.jobs import fit_servos as fit_servos
    from idbench.experiments.api.jobs import study as study
    from idbench.experiments.api.jobs import table1 as table1
    from idbench.experiments.api.jobs import table2 as table2
    from idbench.experiments.api.results import Identification as Identification
    from idbench.experiments.api.results import ParameterEstimate as ParameterEstimate
    from idbench.experiments.api.results import Score as Score
    from idbench.experiments.api.results import SimulatedRun as SimulatedRun
    from idbench.experiments.errors import ExperimentError as ExperimentError
    from idbench.experiments.identification.robot_model import RobotModel as RobotModel
    from idbench.identify import IdentificationError as IdentificationError
    from idbench.identify import MotionLog as MotionLog
    from idbench.identify import TorqueChannel as TorqueChannel
    from idbench.identify import write_log as write_log
    from idbench.sim import load_scenario as load_scenario
    from idbench.sim.errors import BenchError as BenchError
    from idbench.sim.scenario.scenario import Scenario as Scenario

if not (Path(__file__).parent / "sim").is_dir():  # a checkout whose links are text files, as Git for Windows writes them
    root = Path(__file__).parents[2]
    if not (root / "sim").is_dir():
        raise ImportError(f"there is no folder sim in {Path(__file__).parent}, nor in {root}: install idbench again")
    __path__.append(str(root))

PLACES = {
    "experiments.api.calls": ("load_robot", "read_log", "fit", "simulate"),
    "experiments.api.jobs": ("study", "fit_payload", "fit_gains", "fit_servos", "design", "table1", "table2", "StudyTable"),
    "experiments.api.results": ("Identification", "ParameterEstimate", "Score", "SimulatedRun"),
    "experiments.errors": ("ExperimentError",),
    "experiments.identification.robot_model": ("RobotModel",),
    "identify": ("MotionLog", "TorqueChannel", "write_log", "IdentificationError"),
    "sim.errors": ("BenchError",),
    "sim.scenario.scenario": ("Scenario",),
    "sim": ("load_scenario",),
}
"""Where the names are: MuJoCo and the like are loaded when one is first asked for."""

__all__ = sorted(name for names in PLACES.values() for name in names)  # noqa: PLE0605


def __dir__() -> list[str]:
    return [*__all__, "experiments", "identify", "models", "sim"]


def __getattr__(name: str) -> Any:
    module = next((place for place, names in PLACES.items() if name in names), None)
    if module is None:
        raise AttributeError(f"module 'idbench' has no {name!r}; it has {', '.join(__dir__())}")
    return getattr(import_module(f"idbench.{module}"), name)
