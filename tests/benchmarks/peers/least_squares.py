"""Careful least squares with pinocchio's regressor, on the logs that `public_sets.py` has left in its folders.

    uv run --group test python tests/benchmarks/peers/least_squares.py runs/benchmark

Positions are filtered without delay and differentiated; torques and columns are filtered alike and thinned out; rows where the
joint is slow are left out; joints are weighted by their residuals, in turns; columns are reduced to those that are independent.
Torques of the held-out logs, from filtered positions, go into predicted-pinocchio.npz; `public_sets.py` judges them. Beside
them are the estimate, its sigma, and `exact`, which fits the moving joints of the last held-out log: of one without noise,
the truth.
"""

import json
import sys
import time
from pathlib import Path

import numpy as np
import pinocchio as pin
import scipy.linalg
from scipy.signal import butter, sosfiltfilt

SMOOTH = 5.0
"""Cut-off of the positions, in cut-offs of the rows."""

SLOW = 0.05
"""Share of its rms speed below which a joint counts as slow."""

INDEPENDENT = 1e-7
"""Share of the largest pivot of a QR decomposition below which columns depend on others."""

TURNS = 3
NOTE = "OLS weighted by joint, pinocchio's regressor, Ia, Fv, Fs, offset"


class Arm:
    """A robot as columns of its torques."""

    def __init__(self, folder: Path, told: dict) -> None:
        self.model = pin.buildModelFromUrdf(str(folder / told["robot"]))
        self.model.gravity = pin.Motion(np.array(told["gravity"]), np.zeros(3))
        self.data, self.told = self.model.createData(), told
        self.place = [self.model.joints[self.model.getJointId(name)].idx_v for name in told["joints"]]
        self.at = [self.model.joints[self.model.getJointId(name)].idx_q for name in told["joints"]]
        self.wide = [self.model.joints[self.model.getJointId(name)].nq > 1 for name in told["joints"]]

    def columns(self, q, qd, qdd):
        """Return shape (time, joint, column)."""
        n, still = len(self.place), pin.neutral(self.model)
        bodies = []
        for x, v, a in zip(q, qd, qdd, strict=True):
            whole, speed, acceleration = still.copy(), np.zeros(self.model.nv), np.zeros(self.model.nv)
            for angle, at, wide in zip(x, self.at, self.wide, strict=True):
                whole[at : at + 1 + wide] = (np.cos(angle), np.sin(angle)) if wide else angle
            speed[self.place], acceleration[self.place] = v, a
            bodies.append(pin.computeJointTorqueRegressor(self.model, self.data, whole, speed, acceleration)[self.place].copy())
        diagonal = [*([qdd] if self.told["rotors"] else []), qd, np.sign(qd), np.ones_like(qd)]
        joints = np.concatenate([x[:, :, None] * np.eye(n) for x in diagonal], axis=2)
        wrist = [
            (x @ w)[:, None, None] * np.array(w)[None, :, None]
            for w in self.told["couplings"]
            for x in diagonal[: 1 + self.told["rotors"]]
        ]
        wrist += [np.sign(qd @ w)[:, None, None] * np.array(w)[None, :, None] for w in self.told["couplings"]]
        return np.concatenate([np.array(bodies), joints, *wrist], axis=2)


def motion(log, fs, cutoff):
    """Return filtered positions, velocities and accelerations."""
    sos = butter(4, min(SMOOTH * cutoff, 0.4 * fs), fs=fs, output="sos")
    q = sosfiltfilt(sos, log["q"], axis=0)
    qd = np.gradient(q, 1 / fs, axis=0)
    return q, qd, np.gradient(qd, 1 / fs, axis=0)


def rows(arm, log, cutoff):
    """Return columns and torques of a log, filtered and thinned out, and where each joint is fast enough."""
    fs = 1 / np.median(np.diff(log["t"]))
    q, qd, qdd = motion(log, fs, cutoff)
    every = max(1, int(fs / (2 * cutoff) / 4))  # enough for the filter behind
    W, tau = arm.columns(q[::every], qd[::every], qdd[::every]), log["tau"][::every]
    sos = butter(4, cutoff, fs=fs / every, output="sos") if 2 * cutoff < 0.98 * fs / every else None
    if sos is not None:
        low = butter(4, cutoff, fs=fs, output="sos")
        W, tau = sosfiltfilt(sos, W, axis=0), sosfiltfilt(low, log["tau"], axis=0)[::every]
    slow = np.abs(qd) < SLOW * np.sqrt((qd**2).mean(axis=0))
    reach = int(fs / cutoff / 2)
    near = np.array([np.convolve(x, np.ones(2 * reach + 1), "same") > 0 for x in slow.T]).T[::every]
    thin = max(1, int(fs / every / (2 * cutoff)))
    cut = slice(2 * thin, -2 * thin, thin)
    return W[cut], tau[cut], ~near[cut]


def fitted(parts):
    """Return parameters of the independent columns, which these are, and their sigma by the residuals, rows independent."""
    W, tau, there = (np.concatenate(x) for x in zip(*parts, strict=True))
    n, joint = W.shape[1], np.broadcast_to(np.arange(W.shape[1]), there.shape)[there]
    A, y = W[there], tau[there]
    size = np.sqrt((A**2).mean(axis=0))
    used = np.flatnonzero(size > INDEPENDENT * size.max())
    _, R, order = scipy.linalg.qr(A[:, used] / size[used], mode="economic", pivoting=True)
    pivots = np.abs(np.diagonal(R))
    kept = np.sort(used[order[: int((pivots > INDEPENDENT * pivots[0]).sum())]])
    weights = np.ones(n)
    for _ in range(TURNS):
        x = np.linalg.lstsq(A[:, kept] * weights[joint, None] / size[kept], y * weights[joint], rcond=None)[0] / size[kept]
        left = y - A[:, kept] @ x
        weights = np.array([1 / np.sqrt((left[joint == j] ** 2).mean()) for j in range(n)])
    root = np.linalg.inv(np.linalg.qr(A[:, kept] * weights[joint, None] / size[kept], mode="r"))
    return kept, x, np.sqrt((root**2).sum(axis=1)) / size[kept]


def of_set(folder: Path) -> None:
    told = json.loads((folder / "summary.json").read_text())["tools_read"]
    arm, begin = Arm(folder, told), time.perf_counter()
    cutoff = told["cutoff"]
    kept, x, sigma = fitted([rows(arm, dict(np.load(folder / name)), cutoff) for name in told["fit"]])
    seconds, predicted = time.perf_counter() - begin, {}
    for k, name in enumerate(told["held_out"]):
        log = dict(np.load(folder / name))
        fs = 1 / np.median(np.diff(log["t"]))
        predicted[f"held_out{k + 1}"] = arm.columns(*motion(log, fs, cutoff))[:, :, kept] @ x
        W, tau, there = rows(arm, log, cutoff)
        exact = np.linalg.lstsq(W[there][:, kept], tau[there], rcond=None)[0]
    estimate = {"estimate": x, "sigma": sigma, "exact": exact}
    np.savez(folder / "predicted-pinocchio.npz", seconds=seconds, note=NOTE, **estimate, **predicted)
    print(f"{folder.name}: {len(kept)} parameters, {seconds:.1f} s")


if __name__ == "__main__":
    for out in map(Path, sys.argv[1:]):
        for place in sorted(path.parent for path in out.glob("*/summary.json")):
            try:
                of_set(place)
            except (ValueError, KeyError, OSError) as error:
                print(f"{place.name}: {type(error).__name__}: {error}")
