"""Times that benchmarks compare, and what they compare with."""

import time
from collections.abc import Callable
from copy import copy
from importlib.metadata import files
from typing import Any

import mujoco
from mujoco.batch import Batch

from idbench.sim.scenario.scenario import Scenario


def seconds(work: Callable[[], object]) -> float:
    """Return how long one call takes [s]."""
    start = time.perf_counter()
    work()
    return time.perf_counter() - start


def bare(scenario: Scenario, h: float, steps: int, runs: int, threads: int | None = None) -> float:
    """Return how long bare native steps of as many simulations take, pushed by constant torques so that they move [s]."""
    model = copy(scenario.real_robot.model)
    model.opt.timestep, model.opt.integrator = h, mujoco.mjtIntegrator.mjINT_RK4
    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_ACTUATION)
    batch = Batch(model, runs) if threads is None else Batch(model, runs, threads)
    batch.bind("qfrc_applied")[:] = [3.0, 0.3]
    return seconds(lambda: batch.step(nstep=steps))


def ur5() -> Any:
    """Return a UR5 as pinocchio has it."""
    import pinocchio as pin  # of the group `benchmark`, which other benchmarks do without

    (path,) = [f.locate() for f in files("example-robot-data") or () if str(f).endswith("urdf/ur5_robot.urdf")]
    return pin.buildModelFromUrdf(str(path))
