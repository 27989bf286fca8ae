"""`mujoco.sysid` on simulated SCARAs that `public_sets.py` has in its folders; other robots have too many parameters for it.

    uv run --group benchmark python tests/benchmarks/peers/mujoco_tool.py runs/simulated/scara-*-[0-2]

It starts 30 % off and simulates windows of 2 s, as in tests/benchmarks/output_error.py. Torques of the held-out logs, by the
columns of the SCARA, go into predicted-mujoco.npz.
"""

import json
import runpy
import sys
import time
from pathlib import Path

import numpy as np

from idbench.identify import MotionLog, TorqueChannel, scara
from idbench.identify.arrays import combined
from idbench.identify.signals.signals import State
from idbench.sim.robot.robot import Robot
from idbench.sim.robot.scara import scara_truth

FILE = runpy.run_path(str(Path(__file__).parent.parent / "output_error.py"))
OUTPUT_ERROR, SETTING = FILE["output_error"], FILE["SETTINGS"]["mujoco.sysid, filtered"]
NOTE = "output error, start 30 % off, windows of 2 s, at 100 Hz"

RATE = 100.0
"""Sampling frequency that it gets [Hz]: it starts windows at differenced positions, whose counts are noise at 500 Hz."""


def read(path: Path) -> MotionLog:
    """Return a log of torques at instants."""
    with np.load(path) as file:
        return MotionLog(1 / np.median(np.diff(file["t"])), file["q"], file["tau"], TorqueChannel("instantaneous"))


def thinned(log: MotionLog) -> MotionLog:
    """Return a log at 100 Hz, each torque the mean until the next sample."""
    every = round(log.fs / RATE)
    count = log.samples // every
    tau = log.tau[: count * every].reshape(count, every, log.n).mean(axis=1)
    return MotionLog(RATE, log.q[: count * every : every], tau, TorqueChannel("averaged"))


def predicted(log: MotionLog, X: np.ndarray) -> np.ndarray:
    """Return the torques of a motion without noise, by differences of its positions."""
    qd = np.gradient(log.q, 1 / log.fs, axis=0)
    qdd = np.gradient(qd, 1 / log.fs, axis=0).T
    state = State(log.q.T, qd.T, lambda _: qdd)
    return combined(scara().explicit(state), X, np.zeros(log.q.T.shape)).T


def of_set(folder: Path) -> None:
    told, truth = json.loads((folder / "summary.json").read_text())["tools_read"], scara_truth(Robot.load("scara"))
    begin = time.perf_counter()
    X = OUTPUT_ERROR(thinned(read(folder / told["fit"][0])), truth, SETTING)
    seconds = time.perf_counter() - begin
    every = {f"held_out{k + 1}": predicted(read(folder / name), X) for k, name in enumerate(told["held_out"])}
    np.savez(folder / "predicted-mujoco.npz", seconds=seconds, note=NOTE, **every)
    errors = 100 * (X / np.array(list(truth.values())) - 1)
    print(f"{folder.name}: {seconds:.0f} s, errors of the parameters {np.round(errors, 2)} %", flush=True)


if __name__ == "__main__":
    for place in map(Path, sys.argv[1:]):
        of_set(place)
