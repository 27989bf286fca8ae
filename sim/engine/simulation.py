"""Running a scenario, many simulations at once."""

from collections.abc import Callable, Mapping, Sequence
from functools import partial

import numpy as np
import numpy.typing as npt

from idbench.identify.blame import blamed
from idbench.sim.engine.bench import NOISE, Bench, generators
from idbench.sim.engine.plant import side_by_side
from idbench.sim.engine.run import Run, faulty
from idbench.sim.engine.watch import Watch, Watcher
from idbench.sim.errors import ScenarioError
from idbench.sim.robot.robot import Robot
from idbench.sim.scenario.faults import require_joints
from idbench.sim.scenario.scenario import Scenario
from idbench.sim.trajectories import Reference
from idbench.sim.trajectories.time_optimal import approach

Progress = Callable[[float], None]
"""Receives the share of a run that is done."""


def simulate(  # noqa: PLR0913  # all but two by their names
    scenario: Scenario,
    seeds: Sequence[int] = (),
    *,
    motions: Sequence[Reference] = (),
    vary: Mapping[str, npt.ArrayLike] | None = None,
    threads: int = 0,
    progress: Progress | None = None,
    watch: Watch | None = None,
    throw: bool = True,
    informed: bool = False,
) -> Run:
    """Run a scenario in closed loop.

    Parameters
    ----------
    scenario : Scenario
        What to run.
    seeds : sequence of int, optional
        A simulation for each; that of the scenario by default. What a simulation gives depends on its own seed alone.
    motions : sequence of Reference, optional
        A planned motion for each simulation, of equal numbers of samples; that of the scenario's trajectory by default.
    vary : mapping of str to array_like, optional
        Fields of MuJoCo's model, such as dof_damping, with a value for every simulation, shape (nsim, ...).
    threads : int
        Native threads; 0 for all processors. No bit depends on it.
    progress : callable, optional
        Receives the share of the run that is done, about a hundred times.
    watch : Watch, optional
        Receives what the first simulation does, while it runs. No bit depends on it.
    throw : bool
        Raise if a simulation fails while it runs; otherwise `Run.failures` says why, and the others go on.
    informed : bool
        Whether the controller's nominal robot varies, too: its gains and feedforward are then those for the simulated robot.

    Raises
    ------
    ScenarioError
        If settings do not fit each other or the robot, a joint leaves its range, or the loop is unstable.
    RobotError
        If the robot does not have what the scenario asks of it.

    Examples
    --------
    >>> from idbench.sim import load_scenario, run
    >>> simulated = run(load_scenario("ideal"), seeds=range(2))
    >>> simulated.log.q.shape, simulated.alone(1).q.shape
    ((2, 4600, 2), (4600, 2))
    """
    seeds = tuple(seeds) or (scenario.seed,)
    robot = scenario.real_robot
    require_joints(robot, scenario.fault)
    planned, skipped = _joined([_planned(scenario, robot, motion) for motion in motions or (None,)])
    h = scenario.drive.step_length(scenario.fs, scenario.physics.step)
    logged = partial(scenario.torque.logged, n=robot.n, rngs=generators(seeds[:1], NOISE))
    watcher = Watcher(watch, scenario, h, skipped, logged) if watch else None
    step, bearable = 0, 0 if throw else len(seeds) - 1
    # Of simulations that diverge: each is reported, and ends, alone.
    with blamed(), np.errstate(over="ignore", invalid="ignore"), side_by_side(len(seeds), threads) as shares:
        bench = Bench(scenario, robot, planned, seeds, vary or {}, watcher, informed=informed)
        while step < bench.steps and len(bench.failures) <= bearable:
            step = bench.next_stop(step)
            bench.advance(step, shares)
            bench.tell()
            if progress:
                progress(step / bench.steps)
        bench.tell(ended=True)
    run = faulty(bench.run(skipped))
    if throw and run.failures:
        raise ScenarioError(next(iter(run.failures.values())))
    return run


def _joined(planned: Sequence[tuple[Reference, int]]) -> tuple[Reference, int]:
    """Return the motion of all simulations, or of each of them, and the samples before the log begins."""
    motions, skipped = zip(*planned, strict=True)
    if len(motions) == 1:
        return planned[0]
    if len({(len(motion.q), before) for motion, before in planned}) > 1:
        lengths = sorted({len(motion.q) for motion in motions})
        raise ScenarioError(f"motions of {lengths[0]} to {lengths[-1]} samples cannot advance together: group them by length")
    stacked = (np.stack([getattr(motion, x) for motion in motions], axis=1) for x in ("q", "qd", "qdd"))
    return Reference(motions[0].fs, *stacked), skipped[0]


def _planned(scenario: Scenario, robot: Robot, motion: Reference | None) -> tuple[Reference, int]:
    """Return the planned motion, the way to its start before it, and how many samples that takes."""
    main = scenario.trajectory.sample(robot, scenario.fs) if motion is None else motion
    if not scenario.start:
        return main, 0
    way = approach(robot, np.array(scenario.start), main.q[0], scenario.fs)
    joined = (np.concatenate([getattr(way, x), getattr(main, x)]) for x in ("q", "qd", "qdd"))
    return Reference(scenario.fs, *joined), len(way.q)
