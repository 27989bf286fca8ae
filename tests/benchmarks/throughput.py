"""Closed-loop steps per second of the bench, against bare native `mj_step` of the same model on the same threads.

    uv run python tests/benchmarks/throughput.py

64 simulations with 16-bit encoders and a PD loop at 100 Hz; runs are interleaved, so that ratios hold when the machine's
speed drifts.
"""

from dataclasses import replace

import numpy as np
from timing import bare, seconds

from idbench.sim.drives import AbstractDrive, AveragedDrive, IdealDrive, SwitchedDrive
from idbench.sim.encoders import IncrementalEncoder
from idbench.sim.engine.simulation import simulate
from idbench.sim.scenario.scenario_file import load
from idbench.sim.trajectories import RandomMoves

NSIM, RUNS = 64, 7
MOVES = RandomMoves(moves=3, durations=(1.3, 1.3), rest=0.1, seed=3)
DRIVES: dict[str, AbstractDrive] = {
    "ideal": IdealDrive(),
    "averaged": AveragedDrive(),
    "switched, unipolar": SwitchedDrive(),
    "switched, bipolar": SwitchedDrive(modulation="bipolar"),
}


def main() -> None:
    """Print steps per second and the ratio to bare steps for each drive."""
    for name, drive in DRIVES.items():
        scenario = replace(load("ideal"), trajectory=MOVES, drive=drive, encoder=IncrementalEncoder())
        h = drive.step_length(scenario.fs, scenario.physics.step)
        steps = round(MOVES.plan(scenario.nominal_robot).duration / h)
        pairs = []
        for _ in range(RUNS):
            native = bare(scenario, h, steps, NSIM)
            pairs.append((native, seconds(lambda scenario=scenario: simulate(scenario, range(NSIM)))))
        native, ours = np.median(pairs, axis=0)
        ratio = np.median([n / o for n, o in pairs])
        print(f"{name:20} {NSIM * steps / ours:9.0f} steps/s, bare {NSIM * steps / native:9.0f}, ratio {ratio:.2f}")


if __name__ == "__main__":
    main()
