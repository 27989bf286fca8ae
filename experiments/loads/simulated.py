"""Payloads and gains of simulated robots, whose truth is known, run by run."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property, partial
from time import perf_counter
from typing import TypeAlias

import numpy as np

from idbench.experiments.errors import ExperimentError
from idbench.experiments.identification.robot_model import RobotModel
from idbench.experiments.requests.shared import Parameters
from idbench.identify import Array, IdentificationError
from idbench.identify.basis.block import named
from idbench.identify.data.kinematics import INERTIAL
from idbench.identify.loads.drive_gains import identify_drive_gains
from idbench.identify.loads.loaded_robot import LETTERS, LoadedRobot
from idbench.identify.loads.payload import WAYS, PayloadEstimate
from idbench.sim.engine.run import Run
from idbench.sim.engine.simulation import Progress, simulate
from idbench.sim.robot.payload import Payload
from idbench.sim.robot.tree import standard_parameters
from idbench.sim.scenario.scenario import Scenario

GAINS = (0.7, 1.4)  # True gains are drawn between these multiples of those that logs are read with
MOST_RUNS = 1000  # Runs that are simulated at once

Found: TypeAlias = tuple[tuple[str, ...], Array, Array, Array]
"""Names, estimate, sigma and truth."""


@dataclass(frozen=True, eq=False)
class PairScore:
    """How far estimates of many runs are off."""

    names: tuple[str, ...]
    """What was estimated."""
    truth: Array
    """True values, shape (run, p)."""
    error: Array
    """Errors, shape (run, p)."""
    z: Array
    """Errors in standard errors, shape (run, p)."""
    seconds: float
    """A run took."""
    failures: tuple[str, ...] = ()
    """Why runs have no estimate."""

    @property
    def coverage(self) -> float:
        """Share of the estimates within two sigma of the truth."""
        return float(np.mean(np.abs(self.z) < 2)) if self.z.size else float("nan")

    @property
    def rms(self) -> Array:
        """Rms errors, shape (p,)."""
        return np.sqrt(np.mean(self.error**2, axis=0))

    @property
    def bias(self) -> Array:
        """Mean errors, shape (p,)."""
        return np.asarray(np.mean(self.error, axis=0))


@dataclass(frozen=True, eq=False)
class Pairs:
    """A scenario with a payload, simulated with and without it, many times; only what is random differs from run to run."""

    scenario: Scenario
    """With the payload."""
    runs: int
    """How many."""
    parameters: Parameters = Parameters()  # noqa: RUF009  # frozen
    """Which parameters of the robot are identified."""

    def __post_init__(self) -> None:
        if not self.scenario.payload.mass:
            raise ExperimentError(f"scenario {self.scenario.name} has no payload: give it a table [payload] with a mass")
        if not 1 <= self.runs <= MOST_RUNS:
            raise ExperimentError(
                f"--runs {self.runs} must be at least 1 and at most {MOST_RUNS:,}: all are simulated at once, 1 s and 2 MB each"
            )

    @cached_property
    def robot_model(self) -> RobotModel:
        """The robot."""
        return RobotModel(self.scenario.robot, self.parameters)

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

    def payloads(self, told: Progress) -> dict[str, PairScore]:
        """Accuracy of each way for the payload."""
        ways = enumerate(WAYS.items())
        return {way: self._scored(partial(self._payload, of), told, k, len(WAYS)) for k, (way, of) in ways}

    def gains(self, known: Mapping[str, float], told: Progress) -> PairScore:
        """Accuracy of gains that are drawn for each run, given the known payload."""
        rng, n = np.random.default_rng(self.scenario.seed), self.robot_model.tree.n
        true = rng.uniform(*GAINS, (self.runs, n))

        def found(run: int) -> Found:
            gains = identify_drive_gains(self.robot(run, known, true[run]))
            return tuple(named("g", j) for j in range(n)), gains.gains, gains.sigma, true[run]

        return self._scored(found, told)

    def _payload(self, identify: Callable[[LoadedRobot], PayloadEstimate], run: int) -> Found:
        """Return names, estimate, sigma and truth of the payload's base parameters in a run."""
        robot = self.robot(run, {})
        found, base = identify(robot), np.array(list(robot.payload.values())) @ np.array([self.truth[x] for x in LETTERS])
        return found.names, found.X, found.sigma, base

    def _scored(self, one: Callable[[int], Found], told: Progress, number: int = 0, count: int = 1) -> PairScore:
        names, start = tuple[str, ...](), perf_counter()
        rows, failures = list[tuple[Array, Array, Array]](), list[str]()
        for run in range(self.runs):
            try:
                names, X, sigma, truth = one(run)
                rows.append((truth, X - truth, (X - truth) / sigma))
            except IdentificationError as failed:
                failures.append(str(failed))
            told((number + (run + 1) / self.runs) / count)
        truths, errors, z = (np.array([row[part] for row in rows]) for part in range(3))
        return PairScore(names, truths, errors, z, (perf_counter() - start) / self.runs, tuple(failures))
