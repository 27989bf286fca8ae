"""An example to work on: the file of an arm, two logs that it recorded, and its true parameters."""

import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np

from idbench.identify import BaseParameters, tree_basis, write_log
from idbench.sim import Robot, kinematic_tree, load_scenario, run
from idbench.sim.engine.run import ideal_log
from idbench.sim.trajectories import RandomMoves

FS = 250.0  # [Hz], of a common robot controller
DELAY = 0.002  # Sampling frequency [Hz], and delay of the torques [s], which no file of the example states

NOISE = 0.01
"""Of the torques, over their own rms: a tenth of what motor currents have, so that a minute's result can be compared."""

LOGS = {"log.csv": 1, "second.csv": 2}  # Files, and the seeds of their motions
MOVES, VELOCITY = 5, 2.0  # Moves of a log for each joint, and their largest speeds [rad/s]


def example_files(name: str) -> dict[str, str]:
    """Files of an example by their names: a shipped arm in MJCF, logs of two motions in closed loop, true base parameters."""
    robot, plain = Robot.load(name), load_scenario("arm")
    contents = {"arm.xml": Robot.path(name).read_text(encoding="utf-8")}
    for file, seed in LOGS.items():
        moves = RandomMoves(moves=MOVES * robot.n, durations=(0.8, 1.6), velocity=(VELOCITY,), rest=0.5, seed=seed)
        tau = ideal_log(robot, moves.sample(robot, FS)).tau
        torque = replace(plain.torque, noise=tuple((NOISE * np.sqrt(np.mean(tau**2, axis=0))).tolist()))
        timing = replace(plain.timing, delay=DELAY)
        done = run(replace(plain, robot=name, fs=FS, torque=torque, trajectory=moves, timing=timing, seed=seed))
        with tempfile.TemporaryDirectory(prefix="idbench-") as folder:
            path = Path(folder) / file
            write_log(done.alone(), path)
            contents[file] = path.read_text(encoding="utf-8")
    tree = kinematic_tree(robot)
    base = BaseParameters.of(tree, tree_basis(tree))
    rows = zip(base.values(done.truth).items(), base.basis.units, strict=True)
    truth = [f"{parameter},{x:.6g},{unit}\n" for (parameter, x), unit in rows]
    return contents | {"truth.csv": "".join(["parameter,value,unit\n", *truth])}
