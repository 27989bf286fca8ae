"""The job `table1`: a request becomes the paper's comparison, on its motion or one that is searched."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from math import ceil, inf

import numpy as np

from idbench.experiments.errors import ExperimentError
from idbench.experiments.paper.table1 import CHAINS_COMPARED, PAPER, SCENARIO, Table1
from idbench.experiments.requests.jobs import Table1Request
from idbench.identify import CHAINS, MODELS, ExplicitModel, MotionLog, Problem, TorqueChannel, scara
from idbench.identify.rows.row_map import Kernel
from idbench.sim.engine.run import ideal_log
from idbench.sim.robot.motors import Array
from idbench.sim.robot.robot import Robot
from idbench.sim.scenario.scenario import Scenario
from idbench.sim.scenario.scenario_file import load
from idbench.sim.trajectories import Quintic
from idbench.sim.trajectories.quintic import draw_waypoint, draw_waypoints

SEARCHED = MODELS.create("explicit"), MODELS.create("power")  # Of the implicit model Cond(W) is the explicit one's

FS = 100.0  # Sampling frequency [Hz]
REST = 3.0  # Time at rest at both ends [s]
MOTION = 40.0  # Time from the first to the last move [s]
MOVES = 22  # Moves, each within 15 % of MOTION / MOVES long, in whole samples
CHAIN = "paper_masked"  # The chain in which the condition numbers are the paper's: its own steps, reversals left out
CANDIDATES = 16  # Of a round

Searching = Callable[[int, float], None]
"""Hears the round of a search, and how far it is from the paper's condition numbers."""


@dataclass(frozen=True)
class TrajectorySearch:
    """A random search for a motion with the paper's condition numbers, the same for the same seed.

    It draws a sequence of waypoints, then redraws one of them at a time and keeps what comes closer: first to the
    limits of speed and torque, then, within them, to the condition numbers.
    """

    seed: int = 0
    """Of everything random."""
    smallest_move: float = 0.4
    """Least change of every joint in every move [rad]: slower moves would be masked for whole rows."""
    clearance: float = 0.2
    """Least distance to the ends of the joints' ranges [rad]."""
    velocity: float = 7.0
    """Limit of the joints' speed [rad/s]."""
    tolerance: float = 0.01
    """It ends when both condition numbers are within this share of the paper's."""
    rounds: int = 300
    """Rounds after which it gives up."""
    condition: tuple[float, float] = (PAPER["explicit"].condition_number, PAPER["power"].condition_number)
    """Cond(W) of the explicit and of the power model; by default those of the paper's Table 1, Table 2 has 37 and 111."""

    def __post_init__(self) -> None:
        if self.seed < 0:
            raise ExperimentError(f"seed = {self.seed} must be 0 or a positive whole number")
        if not all(1 < x < inf for x in self.condition):
            raise ExperimentError(f"condition = {list(self.condition)}: both must be finite and above 1")
        for name in ("smallest_move", "velocity", "rounds"):
            if not getattr(self, name) > 0:
                raise ExperimentError(f"{name} = {getattr(self, name)} must be above 0")

    def run(self, robot: Robot, progress: Searching | None = None) -> Scenario:
        """Return the scenario found; ExperimentError if the rounds end before the tolerance is reached."""
        rng = np.random.default_rng(self.seed)
        shares = rng.uniform(0.85, 1.15, MOVES)
        # Whole samples, as the paper's plan of 100 Hz has them; together the motion's time.
        durations = np.diff(np.rint(np.cumsum(shares) / shares.sum() * MOTION * FS), prepend=0.0) / FS
        points = draw_waypoints(rng, MOVES + 1, robot.ranges, self.clearance, self.smallest_move)
        best, distance = self._scenario(robot, points, durations), inf
        excess = self.excess(robot, best)
        for number in range(self.rounds):
            redrawn = [self._redrawn(rng, robot, np.array(best.quintic().waypoints)) for _ in range(CANDIDATES)]
            others = [self._scenario(robot, points, durations) for points in redrawn]
            if excess > 0:
                best, excess = min([(best, excess), *((o, self.excess(robot, o)) for o in others)], key=lambda pair: pair[1])
            else:
                best, distance = self._closest(robot, best, distance, others)
            if progress:
                progress(number + 1, distance)
            if distance <= self.tolerance:
                tried = (number + 1) * CANDIDATES
                words = f"idbench search --seed {self.seed} --condition {self.condition[0]:g} {self.condition[1]:g}"
                return replace(best, origin=f"{words}: {tried} candidates, chosen by Cond(W) alone")
        raise ExperimentError(
            f"no motion within {self.tolerance:.2%} of the paper's condition numbers in {self.rounds} rounds "
            f"(closest: {distance:.2%}); try another seed"
        )

    def distances(self, scenarios: Sequence[Scenario]) -> Array:
        """Return the largest departure from the paper's condition numbers, as a share; infinite if a row would be void."""
        q = np.stack([scenario.quintic().points.sample(FS).q for scenario in scenarios])
        log = MotionLog(FS, q, np.zeros_like(q), TorqueChannel("instantaneous"))  # W holds no torque
        problem = Problem((log,), scara(), ExplicitModel(), replace(CHAINS.create(CHAIN), trim=REST))
        worst = np.zeros(len(scenarios))
        for model, target in zip(SEARCHED, self.condition, strict=True):
            rows = problem.with_model(model).rows
            share = np.abs(np.log(rows.factors.together.condition_number / target))
            (to_rows,) = rows.maps  # every row must have an instant that is not masked, however little that is
            reach = ceil(problem.own_chain.operator.halo(log.fs) * log.fs - 1e-9)
            seen = Kernel(np.ones(2 * reach + 1), reach, to_rows.grid).apply(to_rows.inside)
            worst = np.maximum(worst, np.where((seen > 0).all(axis=(-2, -1)), share, inf))
        return worst

    def _closest(self, robot: Robot, best: Scenario, distance: float, others: Sequence[Scenario]) -> tuple[Scenario, float]:
        """Return the closest of `best` and those of `others` that keep the robot's limits."""
        distances = self.distances(others)
        for i in np.argsort(distances, kind="stable"):
            if distances[i] >= distance:
                break
            if self.excess(robot, others[i]) <= 0:
                return others[i], float(distances[i])
        return best, distance

    def excess(self, robot: Robot, scenario: Scenario) -> float:
        """Excess of a motion over the limits of speed and torque, as a share; 0 or less if it keeps them."""
        torque = np.abs(ideal_log(robot, scenario.quintic().points.sample(FS)).tau).max(axis=0)
        used = np.concatenate([scenario.quintic().points.peak_velocity / self.velocity, torque / robot.torque_limits])
        return float(used.max() - 1)

    def _redrawn(self, rng: np.random.Generator, robot: Robot, points: Array) -> Array:
        k = int(rng.integers(len(points)))
        neighbours = np.delete(points, k, axis=0)[max(k - 1, 0) : k + 1]
        points[k] = draw_waypoint(rng, robot.ranges, neighbours, self.clearance, self.smallest_move)
        return points

    def _scenario(self, robot: Robot, points: Array, durations: Array) -> Scenario:
        waypoints = tuple(tuple(float(x) for x in point) for point in points)
        trajectory = Quintic(waypoints, tuple(float(T) for T in durations), REST)
        return Scenario(f"search-{self.seed}", trajectory, robot.name, FS, self.seed)


def table1_of(asked: Table1Request, searching: Searching | None = None) -> Table1:
    """The paper's simulation comparison; ExperimentError, IdentificationError or BenchError if the request is wrong."""
    if asked.seed is not None and asked.scenario is not None:
        raise ExperimentError(f"--seed {asked.seed} and --scenario {asked.scenario} name two trajectories: give one")
    chains = CHAINS_COMPARED if asked.chain == "all" else (asked.chain,)
    if asked.seed is None:
        return Table1(load(asked.scenario or SCENARIO), chains)
    return Table1(TrajectorySearch(asked.seed).run(Robot.load("scara"), searching), chains)
