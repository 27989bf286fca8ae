"""The simulated robot with any parameters, for estimators that simulate: in the loop of a log, and by itself."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Self

import numpy as np
import numpy.typing as npt

from idbench.experiments.identification.robot_model import RobotModel
from idbench.identify import AbstractLoop, AbstractPlant, Array, IdentificationError, MotionLog, Simulated
from idbench.sim.encoders import ExactEncoder
from idbench.sim.engine.driven import shoot
from idbench.sim.engine.simulation import simulate
from idbench.sim.errors import BenchError
from idbench.sim.frictions import CoulombViscous
from idbench.sim.robot.payload import Payload
from idbench.sim.robot.tree import kinematic_tree
from idbench.sim.scenario.measurement import Ripple, TorqueMeasurement
from idbench.sim.scenario.scenario import Scenario
from idbench.sim.trajectories import Reference

IMPOSSIBLE = "; if the loop is right, the parameters are not physically consistent: start from a file of --write"
"""What else it may be."""

SAME = 1e-6  # Share by which frequencies that are the same differ at most


@dataclass(frozen=True, eq=False)
class ScenarioLoop(AbstractLoop):
    """The closed loops of scenarios, one for each log, without noise, ripple and payload."""

    robot_model: RobotModel
    """The robot."""
    scenarios: tuple[Scenario, ...]
    """Controller, timing, drive and motion of each log."""
    logs: tuple[MotionLog, ...]
    """What they are to repeat."""
    motions: tuple[Reference, ...] = ()
    """Planned motions of all runs of the only log, where they differ; those of the scenarios by default."""

    @classmethod
    def of(cls, robot_model: RobotModel, scenarios: tuple[Scenario, ...], logs: tuple[MotionLog, ...]) -> Self:
        """Return the loops of logs, which may be the beginnings of what the scenarios make.

        Raises
        ------
        IdentificationError
            If scenarios are not as many as logs, or one has another robot or frequency than its log, or a shorter motion.
        """
        if len(scenarios) != len(logs):
            raise IdentificationError(f"{len(scenarios)} loops are given for {len(logs)} logs: one scenario is needed for each")
        try:
            for scenario, log in zip(scenarios, logs, strict=True):
                _require_matching(scenario, log, robot_model)
        except BenchError as error:
            raise IdentificationError(f"the loop cannot be simulated: {error}") from error
        return cls(robot_model, scenarios, logs)

    def repeat(self, X: Array, *, informed: bool = False, exact: bool = True) -> Simulated:
        """Return the logs that robots with these parameters give."""
        flat = X.reshape(-1, X.shape[-1])
        vary, failures = self.robot_model.fields(flat, exact=exact), dict[tuple[int, ...], str]()
        made = [self._log(k, X.shape[:-1], vary, failures, informed=informed) for k in range(len(self.logs))]
        return Simulated(tuple(made), failures)

    def _log(
        self, k: int, shape: tuple[int, ...], vary: Mapping[str, Array], failures: dict[tuple[int, ...], str], *, informed: bool
    ) -> MotionLog:
        nsim = int(np.prod(shape, dtype=np.intp))
        motions = [*self.motions] * (nsim // len(self.motions)) if self.motions else ()
        try:
            alone = noiseless(self.scenarios[k])
            run = simulate(alone, range(nsim), motions=motions, vary=vary, throw=False, informed=informed)
        except BenchError as error:
            raise IdentificationError(f"the loop cannot be simulated: {error}") from error
        for sim, why in run.failures.items():
            place = tuple(int(i) for i in np.unravel_index(sim, shape)) if shape else ()
            failures.setdefault(place, f"the robot with the parameters of a round cannot be simulated: {why}{IMPOSSIBLE}")
        samples = self.logs[k].samples
        q, tau = (x[:, :samples].reshape(*shape, samples, x.shape[-1]) for x in (run.log.q, run.log.tau))
        return replace(run.log, q=q, tau=tau, conditions={})


@dataclass(frozen=True, eq=False)
class RobotPlant(AbstractPlant):
    """The robot by itself."""

    robot_model: RobotModel
    """The robot."""

    def shoot(self, X: Array, q: Array, qd: Array, log: MotionLog, first: npt.NDArray[np.intp], count: int) -> Array:
        """Return the positions of robots that start somewhere in a log."""
        try:
            return shoot(self.robot_model.robot, self.robot_model.fields(X), (q, qd), log, first, count)
        except BenchError as error:
            raise IdentificationError(f"the robot cannot be simulated: {error}") from error


def noiseless(scenario: Scenario) -> Scenario:
    """Return a scenario without what is random, or not known of a robot: noise, counts, jitter, ripple, payload, friction."""
    return replace(
        scenario,
        encoder=ExactEncoder(),
        torque=TorqueMeasurement(source=scenario.torque.source, cutoff=scenario.torque.cutoff),
        timing=replace(scenario.timing, jitter=0.0),
        ripple=Ripple(),
        payload=Payload(),
        friction=CoulombViscous(),
    )


def _require_matching(scenario: Scenario, log: MotionLog, robot_model: RobotModel) -> None:
    """Raise IdentificationError if a scenario is no loop of a log: other robot, frequency or duration."""
    name, other = f"loop {scenario.name}", scenario.nominal_robot
    if other.joints != robot_model.robot.joints:
        raise IdentificationError(
            f"{name} moves robot {scenario.robot}, whose joints are {', '.join(other.joints)}: it is none of {robot_model.name}"
        )
    if missing := {c.name for c in robot_model.tree.couplings} - {c.name for c in kinematic_tree(other).couplings}:
        names = " and ".join(sorted(missing))
        raise IdentificationError(
            f"{name} moves robot {scenario.robot}, whose file has no drive {names}: write a file with it (--coupling describes "
            "it in the fit alone), or leave --loop or --coupling out"
        )
    if abs(scenario.fs / log.fs - 1) > SAME:
        raise IdentificationError(f"{name} runs at {scenario.fs:g} Hz, the log has {log.fs:g} Hz: write the log's fs into it")
    if (samples := round(scenario.trajectory.motion(other).duration * scenario.fs)) < log.samples:
        raise IdentificationError(
            f"{name} moves for {samples / scenario.fs:g} s, the log for {log.samples / log.fs:g} s: it is of another motion"
        )
