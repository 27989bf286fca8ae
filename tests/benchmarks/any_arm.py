"""Any arm: the explicit columns of six joints against pinocchio's regressor in a loop, and an hour's log in bounded memory.

uv run --group benchmark python tests/benchmarks/any_arm.py
"""

import threading
import time
from importlib.metadata import files
from pathlib import Path

import numpy as np
import pinocchio as pin

from idbench.identify import (
    ESTIMATORS,
    MODELS,
    BaseParameters,
    Joint,
    KinematicTree,
    MotionLog,
    State,
    TreeLinks,
    identify_each,
    tree_basis,
)
from idbench.sim.engine.run import ideal_log
from idbench.sim.robot.robot import Robot
from idbench.sim.robot.tree import kinematic_tree
from idbench.sim.trajectories import RandomMoves

SAMPLES, ROUNDS = 4000, 7


def best(function):
    """Return the shortest of some times [s]."""
    times = []
    for _ in range(ROUNDS):
        start = time.perf_counter()
        function()
        times.append(time.perf_counter() - start)
    return min(times)


def regressor():
    """Print the time of the explicit columns of a UR5 against pinocchio's, 4000 samples, in the same run."""
    (path,) = [f.locate() for f in files("example-robot-data") or () if str(f).endswith("urdf/ur5_robot.urdf")]
    model = pin.buildModelFromUrdf(str(path))
    data = model.createData()
    axes = [np.ravel(model.joints[i].createData().S[3:]) for i in range(1, model.njoints)]
    places = model.jointPlacements
    joints = [
        Joint(model.names[i], "hinge", model.parents[i] - 1, places[i].translation, places[i].rotation, axes[i - 1], [0, 0, 0])
        for i in range(1, model.njoints)
    ]
    tree = KinematicTree("ur5", tuple(joints), model.gravity.linear)
    q, qd, qdd = np.random.default_rng(0).uniform(-2, 2, (3, tree.n, SAMPLES))
    block, base = TreeLinks(tree), BaseParameters.of(tree, tree_basis(tree)).basis

    def theirs():
        for k in range(SAMPLES):
            pin.computeJointTorqueRegressor(model, data, q[:, k], qd[:, k], qdd[:, k])

    loop = best(theirs)
    for name, columns in (("60 standard parameters", block.explicit), ("52 base parameters", base.explicit)):
        mine = best(lambda columns=columns: columns(State(q, qd, lambda _: qdd)))
        print(f"explicit columns, 6 joints, {SAMPLES} samples, {name}: {1e3 * mine:.1f} ms, a loop over pinocchio's regressor "
              f"{1e3 * loop:.1f} ms, ratio {mine / loop:.2f}")  # fmt: skip


def resident():
    """Return the memory of this process [GB]."""
    return int(Path("/proc/self/statm").read_text().split()[1]) * 4096 / 1e9


def hour(estimator):
    """Print time and memory of all three models on an hour at 1 kHz of seven joints, against a log of 100 s."""
    robot = Robot.load("panda")
    tree = kinematic_tree(robot)
    basis = BaseParameters.of(tree, tree_basis(tree)).basis
    moves = RandomMoves(moves=60, durations=(0.8, 1.6), velocity=(2.0,), rest=0.5)
    log, models = ideal_log(robot, moves.sample(robot, 1000.0)), {name: MODELS.create(name) for name in MODELS.builtin}
    count = int(np.ceil(3.6e6 / log.samples))
    long = MotionLog(log.fs, np.concatenate([log.q] * count), np.concatenate([log.tau] * count), log.torque)
    before, most, done = resident(), [0.0], threading.Event()

    def watch():
        while not done.wait(0.01):
            most[0] = max(most[0], resident())

    watcher = threading.Thread(target=watch)
    watcher.start()
    start = time.perf_counter()
    identify_each(long, basis, models, estimator=ESTIMATORS.create(estimator))
    took = time.perf_counter() - start
    done.set()
    watcher.join()
    short = log.part(0, 100_000)
    each = best(lambda: identify_each(short, basis, models, estimator=ESTIMATORS.create(estimator))) / short.samples
    print(f"{long.samples} samples x 7 joints, {len(basis.names)} parameters, three models, {estimator}: {took:.0f} s,")
    print(f"{most[0] - before:.2f} GB above the log, itself {2 * long.q.nbytes / 1e9:.2f} GB;")
    print(f"cost of a sample against a log of 100 000: {took / long.samples / each:.2f}")


if __name__ == "__main__":
    regressor()
    for name in ("WLS", "GLS"):
        hour(name)
