"""Positions and torques of the motors turned to those of the joints, in two files: motor 6 turns with joints 5 and 6."""

import numpy as np

RATIOS, FS = (32.0, 32.0, 45.0, -48.0, 45.0, 32.0), 5000.0
ZEROS = np.array([0.0, -np.pi / 2, np.pi / 2, 0.0, 0.0, 0.0])
PARTS = {"first.csv": slice(0, 26_000), "last.csv": slice(32_500, 45_000)}

matrix = np.diag(RATIOS)
matrix[5, 4] = RATIOS[5]
motors, torques = (np.loadtxt(f"{name}.csv", delimiter=",", skiprows=1) for name in ("pos_read_data", "curr_data"))
q, tau = motors @ np.linalg.inv(matrix).T + ZEROS, torques @ matrix
head = ",".join(["t", *(f"q{j}" for j in range(1, 7)), *(f"tau{j}" for j in range(1, 7))])
for name, part in PARTS.items():
    t = np.arange(part.stop - part.start)[:, None] / FS
    np.savetxt(name, np.hstack([t, q[part], tau[part]]), fmt="%.9g", delimiter=",", header=head, comments="")
