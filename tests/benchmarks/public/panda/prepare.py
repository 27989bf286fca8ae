"""One table of the files of positions, velocities and torques, which have a number a line, and of the times."""

import numpy as np

t = np.loadtxt("exciting_traj_time.txt")
parts = [np.loadtxt(f"exciting_traj_{name}.txt").reshape(len(t), 7) for name in ("positions", "velocity", "torques")]
head = ",".join(["t", *(f"{letter}{j}" for letter in ("q", "qd", "tau") for j in range(1, 8))])
np.savetxt("exciting.csv", np.hstack([t[:, None], *parts]), fmt="%.9g", delimiter=",", header=head, comments="")
