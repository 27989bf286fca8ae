"""The job `run`: a request becomes a scenario, simulated and identified; or one run of a study, once more."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from idbench.experiments.errors import ExperimentError
from idbench.experiments.identification.method import Method
from idbench.experiments.identification.request import Request
from idbench.experiments.identification.robot_model import RobotModel, absolute
from idbench.experiments.identification.scenario_run import ScenarioRun
from idbench.experiments.requests.jobs import RunRequest
from idbench.experiments.requests.shared import Parameters
from idbench.experiments.study.axis import Combination
from idbench.sim.drives import IdealDrive
from idbench.sim.errors import RobotError
from idbench.sim.robot.robot import Robot
from idbench.sim.scenario.measurement import Ripple
from idbench.sim.scenario.scenario import Scenario
from idbench.sim.scenario.scenario_file import load
from idbench.sim.trajectories import Quintic


def run_of(asked: RunRequest, tell: Callable[[str], None]) -> ScenarioRun:
    """Scenario and request of a run; `tell` hears what was assumed.

    ExperimentError, IdentificationError or BenchError if something is wrong with the request, or with the files that it names.
    """
    if asked.scenario is None:
        if asked.robot is not None:
            raise ExperimentError(f"--robot {asked.robot}: a run of a study is of the study's robot")
        scenario, combination = _again(tell, asked.study, asked.index, asked.method)
        method, parameters = combination.method, Parameters(friction=tuple(combination.friction.split()))
        name = f"{method.chain_name}-{method.estimator_name}-study"
        if asked.parameters != Parameters():
            raise ExperimentError("--from: which parameters are identified is the study's; leave --friction and the like out")
    else:
        if asked.study is not None or asked.index is not None:
            raise ExperimentError(f"{asked.scenario} and --from or --index: name a scenario, or a run of a study")
        scenario = _with_robot(tell, load(asked.scenario), asked.robot)
        method, parameters, name = Method.named(asked.chain, asked.estimator), asked.parameters, ""
    robot_model = RobotModel(scenario.robot, parameters)
    return ScenarioRun(scenario, Request(robot_model, method=method, name=name, start=asked.start))


def _with_robot(tell: Callable[[str], None], scenario: Scenario, robot: str | None) -> Scenario:
    """Return a scenario with another robot, and moves that fit it."""
    if robot is None:
        return scenario
    other = replace(scenario, robot=absolute(robot), name=f"{scenario.name}-{Path(robot).stem}")
    if isinstance(scenario.trajectory, Quintic) and Robot.load(robot).n != Robot.load(scenario.robot).n:
        tell(f"the trajectory of {scenario.name} does not fit robot {robot}: the random moves of scenario arm are used")
        other = replace(other, trajectory=load("arm").trajectory, start=())
    if not other.drive.has_own_motors and not _has_motors(robot):
        tell(f"robot {robot} has no motors (dcmotor elements of MJCF): its drives are ideal, without ripple")
        other = replace(other, drive=IdealDrive(), ripple=Ripple())
    return other


def _has_motors(robot: str) -> bool:
    try:
        return Robot.load(robot).motors is not None
    except RobotError:
        return False


def _again(
    tell: Callable[[str], None], folder: Path | None, index: int | None, method: int | None
) -> tuple[Scenario, Combination]:
    """Return the scenario of a run of a study, which is reproduced, and how it is identified."""
    from idbench.experiments.study.job import compare_again
    from idbench.experiments.study.store import Store

    if folder is None or index is None:
        raise ExperimentError("name a scenario, as idbench scenario lists them, or a run of a study: --from DIR --index N")
    store = Store.open(folder)
    number, methods = method or 0, store.study.methods
    if not 0 <= number < len(methods):
        raise ExperimentError(f"--method {number} does not exist: the study has methods 0 to {len(methods) - 1}")
    of_currents = Combination(Method.named(), "standard", ())  # in the place of that for the closed loop of servos
    chosen = of_currents if store.study.of_servos else methods[number]
    rows, known = compare_again(store, index)
    tell(
        f"run {index} of {folder}: all {len(rows)} rows are the same again, bit for bit"
        if known
        else f"run {index} of {folder}, which the study has not finished yet"
    )
    words = [chosen.method.chain_name, chosen.method.estimator_name, *(f"{s.axis.field} {s.label}" for s in chosen.settings)]
    tell(f"shown: method {number} of the study's {len(methods)}: {', '.join(words)}")
    for reason in dict.fromkeys(row["failure"] for row in rows if row["failure"]):
        tell(f"warning: {reason}")
    return replace(store.study.scenario_of(index), name=f"{store.study.name}-{index}"), chosen
