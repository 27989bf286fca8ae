"""What it costs to design a motion: ten seconds for each arm that ships, from any seed.

    uv run python tests/benchmarks/excite.py [SEEDS [ROBOT ...]]

For each arm: the time of a whole design (random motions, search, limits at 1 kHz, predictions); that of one value with its
slope, over that of the columns at the same states; the typical sigma relative to the median and the best random motion; how
far the worst of the seeds is from the best.
"""

import statistics
import sys
import time
from dataclasses import replace
from functools import partial

import numpy as np
from timing import seconds

from idbench.experiments.excite.design import Design
from idbench.experiments.excite.excited import Excited
from idbench.sim.encoders import IncrementalEncoder
from idbench.sim.scenario.measurement import TorqueMeasurement
from idbench.sim.scenario.scenario_file import load

TIMES = 20
"""Repetitions of short work."""


def designed(robot: str, seed: int) -> tuple[Excited, float]:
    """Return a motion, and how long it took."""
    noisy = replace(load("ideal"), encoder=IncrementalEncoder(lines=(32768,)), torque=TorqueMeasurement(noise=(0.05,)))
    start = time.perf_counter()
    found = Excited.of(Design(robot, noisy, seed=seed))
    _ = found.sigmas
    return found, time.perf_counter() - start


def main(seeds: int, robots: tuple[str, ...] = ("scara", "puma560", "panda")) -> None:
    """Time and judge designs."""
    for robot in robots:
        each = [designed(robot, seed) for seed in range(seeds)]
        found, plan = each[0][0], each[0][0].design.plan
        value = statistics.median(seconds(partial(plan.value, found.c)) for _ in range(TIMES))
        columns = statistics.median(seconds(partial(plan.information.columns, plan.motion(found.c))) for _ in range(TIMES))
        typical = [float(np.log(one.sigma).mean()) for one, _ in each]
        median, best = (max(one.ratios[i] for one, _ in each) for i in (0, 1))
        print(
            f"{robot}: {statistics.median(t for _, t in each):.1f} s (at most {max(t for _, t in each):.1f}), a slope "
            f"{1e3 * value:.1f} ms, {value / columns:.1f} columns; at most {median:.2f} of the median and {best:.2f} of the "
            f"best random motion; the worst of {seeds} seeds {np.exp(max(typical) - min(typical)):.3f} of the best",
            flush=True,
        )


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 3, *([tuple(sys.argv[2:])] if sys.argv[2:] else []))
