"""What a study of servos finds: parameters of every joint, from commands and positions alone."""

from collections.abc import Iterator, Mapping, Sequence
from functools import cache
from typing import Any

import numpy as np

from idbench.experiments.servo.identification import known_servos
from idbench.experiments.servo.joints import Joints, JointsLog
from idbench.experiments.study.statistics import BOUNDS
from idbench.identify import MotionLog
from idbench.identify.basis.block import named
from idbench.identify.files.servo_log import ServoColumns
from idbench.identify.servo import ServoFit, identify_servo, parameters_of
from idbench.sim.drives import ServoDrive
from idbench.sim.engine.run import Run
from idbench.sim.robot.servos import links
from idbench.sim.scenario.scenario import Scenario
from idbench.sim.settings import per_joint


def law_of(text: str) -> tuple[str, tuple[str, ...]]:
    """Return a law of friction, and what else is found, as `load+lead` states it."""
    friction, *more = text.split("+")
    return friction, tuple(more)


def names_of(scenario: Scenario, laws: Sequence[str]) -> tuple[str, ...]:
    """Return the parameters of all joints with any of the laws."""
    letters = dict.fromkeys(x for text in laws for x in parameters_of(*law_of(text)))
    return tuple(named(x, j) for j in range(scenario.real_robot.n) for x in letters)


def truth_of(scenario: Scenario) -> dict[str, float]:
    """Return the parameters of the servos of a scenario."""
    robot, drive = scenario.real_robot, scenario.drive
    assert isinstance(drive, ServoDrive)
    K, R, play = (per_joint(x, robot.n, "drive") for x in (drive.torque_constant, drive.resistance, drive.backlash))
    model, found = robot.model, dict[str, float]()
    for j in range(robot.n):
        of_joint = {"a": K[j] / R[j], "b": K[j] ** 2 / R[j], "Ia": model.dof_armature[j], "Fs": model.dof_frictionloss[j]}
        of_joint |= {"Fv": model.dof_damping[j], "backlash": play[j]}
        of_joint |= {"offset": 0.0, "delay": scenario.timing.delay, "rate": drive.rate or np.inf}
        of_joint |= {"lead": drive.lead, "dead_band": drive.dead_band}
        if not drive.off:  # then damping shows as one
            of_joint |= {"b": of_joint["b"] + of_joint["Fv"], "Fv": 0.0}
        found |= {named(name, j): float(x) for name, x in of_joint.items()}
    return found | scenario.friction.truth(robot)


def servo_columns(law: str, simulated: Run, i: int) -> dict[str, float] | str:
    """Return the parts of every parameter that one run gives, by their names, or why it gives none.

    Joints that are refused have none, and torques without a scale are left out.
    """
    truth = truth_of(simulated.scenario)
    found, why = dict[str, float](), list[str]()
    joints = _joints(simulated.scenario, simulated.log.run((i,)))
    for j, fit in dict(joints.identified(lambda _, runs: identify_servo(runs, *law_of(law)))).items():
        if not isinstance(fit, ServoFit):
            why.append(str(fit))
            continue
        for name, sigma in fit.standard_errors.items():
            if name in fit.unscaled:
                continue
            at, bound = named(name, j), fit.bound[name]
            found |= {at: fit.p[name], f"{at}.sigma": sigma, f"{at}.paper_sigma": bound, f"{at}.truth": truth.get(at, np.nan)}
            found |= dict.fromkeys((at + part for part in BOUNDS), bound)
    return found or "; ".join(why)


def rows_of(
    names: Sequence[str], parts: Sequence[str], law: str, simulated: Run, common: Sequence[Mapping[str, Any]]
) -> Iterator[dict[str, Any]]:
    """Yield a row for each run, `common` being what the row says of it beside what is found."""
    for i, said in enumerate(common):
        columns = simulated.failures.get(i) or servo_columns(law, simulated, i)
        if isinstance(columns, str):
            yield {**said, "failure": columns}
        else:
            every = {name + part: columns.get(name + part, np.nan) for name in names for part in parts}
            yield {**said, "condition_number": np.nan, "rows": 0, "residual_rms": np.nan, "simulations": 0, **every}


def _joints(scenario: Scenario, log: MotionLog) -> Joints:
    """Known data of a scenario's servos and of an added mass, with a log."""
    assert isinstance(scenario.drive, ServoDrive)
    on, servos = log.conditions.get("on"), known_servos(scenario.drive, log.n)
    columns = ServoColumns(
        log.t, log.q, log.conditions["command"], None if on is None else np.broadcast_to(on, log.q.shape), None
    )
    robot = _links(scenario.robot, payload=scenario.payload)
    return Joints(robot, (JointsLog("the log", columns, tuple(servos), robot),))


_links = cache(links)
