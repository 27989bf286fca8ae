"""Logs of ideal robots with noise: what tests of written files fit."""

from dataclasses import replace

import numpy as np

from idbench.sim.engine.run import ideal_log
from idbench.sim.robot.robot import Robot
from idbench.sim.trajectories import RandomMoves


def noisy_log(name, seed):
    """Return the log of an ideal robot with 1 % of noise in its torques, and an encoder of 16 bits."""
    robot, rng = Robot.load(name), np.random.default_rng(seed)
    moves = RandomMoves(moves=10, durations=(0.8, 1.2), velocity=(2.0,), rest=0.2, seed=seed)
    log = ideal_log(robot, moves.sample(robot, 200.0))
    count = 2 * np.pi / 2**16
    noise = 0.01 * log.tau.std(axis=0) * rng.standard_normal(log.tau.shape)
    return replace(log, q=count * np.round(log.q / count), tau=log.tau + noise)
