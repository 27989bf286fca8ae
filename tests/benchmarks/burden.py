"""What the rows of the models cost, beside the explicit model's in the same run, and how many operations they take.

uv run python tests/benchmarks/burden.py
"""

import time

import numpy as np

from idbench.experiments.identification.robot_model import RobotModel
from idbench.identify import MODELS, Problem, idbench_chain
from idbench.identify.basis.operations import operations
from idbench.sim.engine.run import ideal_log
from idbench.sim.trajectories import RandomMoves

ROUNDS = 9
ROBOTS = ("scara", "puma560", "panda")
COMPARED = ("explicit", "implicit", "power")


def seconds(log, basis, model):
    """Return the processor time of the rows of a model, signals and velocities made anew [s]."""
    problem = Problem((log,), basis, MODELS.create(model), idbench_chain())
    start = time.process_time()
    _ = problem.signals[0].state.qdd
    between = time.process_time()
    _ = problem.rows_of(problem.signals[0])
    return time.process_time() - between, between - start


def main():
    """Print, for each robot, medians of the ratios of rounds in turns."""
    for name in ROBOTS:
        robot_model = RobotModel(name)
        robot, basis = robot_model.robot, robot_model.basis
        moves = RandomMoves(moves=30, durations=(1.2, 1.6), velocity=(2.0,), rest=1.0).sample(robot, 100.0)
        log = ideal_log(robot, moves)
        found = np.array([[seconds(log, basis, model)[0] for model in COMPARED] for _ in range(ROUNDS + 1)])[1:]
        ratios = np.median(found / found[:, :1], axis=0)
        counts = [operations(basis, model) for model in COMPARED]
        for model, ratio, count in zip(COMPARED, ratios, counts, strict=True):
            share = count.total / counts[0].total
            print(f"{name:9} {model:9} rows {ratio:.2f}, operations {share:.2f} of the explicit model's: {count}")


if __name__ == "__main__":
    main()
