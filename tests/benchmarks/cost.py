"""What people wait for: whole commands, beside fixed peers in the same run; and how costs grow.

    uv run --group benchmark python tests/benchmarks/cost.py

User CPU of whole processes [s], of some turns the least, over that of importing NumPy; memory is the largest of the process.
A simulated run is compared with the bare `mj_step` of its robot, fits with a loop over pinocchio's regressor and with a careful
least squares by hand (filters, pinocchio's regressor, QR). Commands write bytecode, as an installed program has it.
"""

import os
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

TURNS = 3
PLAIN = os.environ | {"OPENBLAS_NUM_THREADS": "1", "NO_COLOR": "1"}
PLAIN.pop("PYTHONDONTWRITEBYTECODE", None)

NUMPY = [sys.executable, "-c", "import numpy"]
IDBENCH = [sys.executable, "-c", "from idbench.experiments.cli import entry; entry()"]

TWO = "identify two/log.csv --robot two/arm.xml --torque held --no-rerun"
SIX = "identify six/log.csv --robot six/arm.xml --torque held --torque-delay 0.002 --out found --force"
COMMANDS = {
    "--help": "--help",
    "list": "list",
    "identify, two links": f"{TWO} --torque-delay 0.002",
    "the same with an estimated delay": f"{TWO} --torque-delay estimate",
    "identify, six joints, 23 000 samples": SIX,
    "the same without a recording": f"{SIX} --no-rerun",
    "identify, one model, WLS, not tried further": f"{SIX} --no-rerun --model explicit --estimator WLS --no-trials",
    "robot, six joints": "robot six/arm.xml",
    "excite, six joints": "excite six/arm.xml --out excited --force",
    "new example, two links": "new example NAME",
    "run ripple, 46 s at 5 kHz": "run ripple --out ran --force",
    "run arm, seven joints": "run arm --out arm --force",
    "table1": "table1 --out one --force",
    "table2": "table2 --out two-tables --force",
}
"""What is timed, and its words."""

LONG = ("excite", "run", "table")
"""Commands that are timed once."""

BARE = """
import mujoco
from idbench import models
model = mujoco.MjModel.from_xml_path(str(models.path({robot!r})))
model.opt.timestep, model.opt.integrator = {h}, mujoco.mjtIntegrator.mjINT_RK4
data = mujoco.MjData(model)
for _ in range({steps}):
    mujoco.mj_step(model, data)
"""

BY_HAND = """
import numpy as np, pinocchio as pin, scipy.signal
model = pin.Model()
for j in range(6):  # what it costs does not depend on the lengths
    model.addJoint(j, [pin.JointModelRZ, pin.JointModelRY][j % 2](), pin.SE3.Identity(), f"joint{j}")
data = model.createData()
t, *columns = np.loadtxt("six/log.csv", delimiter=",", skiprows=1).T
q, tau = np.array(columns[:6]), np.array(columns[6:])
fs = 1 / np.median(np.diff(t))
low = scipy.signal.butter(4, 10, fs=fs, output="sos")
q, tau = (scipy.signal.sosfiltfilt(low, x) for x in (q, tau))
qd = np.gradient(q, 1 / fs, axis=1)
qdd = np.gradient(qd, 1 / fs, axis=1)
W = np.array([pin.computeJointTorqueRegressor(model, data, *x) for x in zip(q.T, qd.T, qdd.T)])
more = np.concatenate([np.einsum("ij,jt->tij", np.eye(6), x)[..., :, :] for x in (qd, np.sign(qd), qdd)], axis=2)
W = scipy.signal.sosfiltfilt(low, np.concatenate([W, more], axis=2), axis=0)[::10]
np.linalg.lstsq(W.reshape(-1, W.shape[-1]), tau.T[::10].ravel(), rcond=1e-8)
"""

FIT = """
import time
import numpy as np
from idbench.identify import *
from idbench.identify import Joint, KinematicTree
from idbench.identify.basis.newton_euler import torques
from idbench.identify.signals.signals import State
n, samples, estimator, models = {n}, {samples}, {estimator!r}, {models}
rng = np.random.default_rng(0)
at = [[0.0, 0.0, 0.2 * (k > 0)] for k in range(n)]
joints = tuple(Joint(f"j{{k}}", "hinge", k - 1, at[k], np.eye(3), np.eye(3)[k % 3], np.zeros(3)) for k in range(n))
tree = KinematicTree("chain", joints, [0, 0, -9.81])
basis = BaseParameters.of(tree, tree_basis(tree)).basis
w = 2 * np.pi * rng.uniform(0.05, 0.4, (n, 3, 1))
a, phase = rng.uniform(-0.4, 0.4, (n, 3, 1)), rng.uniform(0, 6, (n, 3, 1))
X = rng.uniform(0.1, 1.0, len(basis.names))
every, forces = np.empty((2, samples, n))
for begin in range(0, samples, 10_000):  # or what is made of the log would take more memory than the fit
    t = np.arange(begin, min(begin + 10_000, samples)) / 500.0
    q, qd, qdd = ((a * w**k * np.sin(w * t + phase + k * np.pi / 2)).sum(axis=1) for k in range(3))
    tau = torques(basis, State(q, qd, lambda _: qdd), X)
    forces[begin : begin + len(t)] = (tau + 0.01 * rng.standard_normal(tau.shape)).T
    every[begin : begin + len(t)] = (q + 1e-5 * rng.standard_normal(q.shape)).T
log = MotionLog(500.0, every, forces, TorqueChannel("instantaneous"))
made = {{name: MODELS.create(name) for name in models}}
begin = time.process_time()
for estimate in identify_each(log, basis, made, estimator=ESTIMATORS.create(estimator)).values():
    estimate.own_sigma
print("fit", time.process_time() - begin)
"""


def spent(words: list[str], folder: Path) -> tuple[float, float, str]:
    """Return user CPU [s] and largest memory [GB] of a process, and what it printed; exit where it fails."""
    with subprocess.Popen(
        words, cwd=folder, env=PLAIN, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True
    ) as process:
        assert process.stdout is not None
        out = process.stdout.read()
        _, status, used = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode:
        sys.exit(f"{' '.join(words[2:])} failed")
    return used.ru_utime, used.ru_maxrss / 1e6, out


def commands(folder: Path) -> None:
    """Print what commands take, in turns with importing NumPy."""
    spent([*IDBENCH, "new", "example", "two"], folder)
    spent([*IDBENCH, "new", "example", "six", "--robot", "puma560"], folder)
    hand = min(spent([sys.executable, "-c", BY_HAND], folder)[0] for _ in range(TURNS))
    print(f"{'':48} {'user s':>7} {'of numpy':>8} {'GB':>5}", flush=True)
    print(f"{'six joints by hand, least squares':48} {hand:7.2f}", flush=True)
    for name, words in COMMANDS.items():
        pairs = []
        for turn in range(1 if words.startswith(LONG) else TURNS):
            peer = spent(NUMPY, folder)[0]
            pairs.append((*spent([*IDBENCH, *words.replace("NAME", f"again{turn}").split()], folder)[:2], peer))
        used, memory, peer = np.min(pairs, axis=0)
        print(f"{name:48} {used:7.2f} {used / peer:8.1f} {memory:5.2f}", flush=True)
    for robot, h, steps, name in (("scara", 2e-4, 230_000, "ripple"), ("panda", 1e-3, 128_000, "arm")):
        bare = spent([sys.executable, "-c", BARE.format(robot=robot, h=h, steps=steps)], folder)[0]
        print(f"{f'bare mj_step of run {name}':48} {bare:7.2f}", flush=True)


def growth(folder: Path) -> None:
    """Print time and memory over joints and samples, with the exponents between neighbours."""
    joints, samples = (6, 15, 30), (20_000, 80_000, 240_000, 1_000_000, 3_600_000)
    one, all_ = {"samples": 10_000, "models": ["explicit"]}, {"n": 6, "models": ["explicit", "implicit", "power"]}
    series = {
        f"{what}, {estimator}": (key, values, {**fixed, "estimator": estimator})
        for what, key, values, fixed in (
            ("joints, 10 000 samples, explicit", "n", joints, one),
            ("samples, 6 joints, three models", "samples", samples, all_),
        )
        for estimator in ("WLS", "GLS")
    }
    for name, (key, values, fixed) in series.items():
        print(name)
        last = None
        for value in values:
            _, memory, out = spent([sys.executable, "-c", FIT.format(**{**fixed, key: value})], folder)
            took = float(out.split()[-1])
            exponent = "" if last is None else f"exponent {np.log(took / last[1]) / np.log(value / last[0]):.2f}"
            print(f"    {value:9} {took:8.2f} s {memory:6.2f} GB  {exponent}", flush=True)
            last = value, took


if __name__ == "__main__":
    with tempfile.TemporaryDirectory(prefix="idbench-") as made:
        growth(Path(made))
        commands(Path(made))
