"""Joints under position loops, from commands and positions of plain MuJoCo: how often the file is within two sigma.

    uv run python tests/benchmarks/position_loops.py [RUNS] [NAME ...]

A leg of three joints under torque PD, hung; an arm of six under `position` actuators, by Euler and by an implicit integrator; a
bench of one mass with a DC motor. Positions are rounded to 14 bits (12 of the motor), logged at 100 Hz. A row each: coverage of
two sigma of every parameter, its error in rms over all runs, and the largest error of the delay. Masses and motions differ from
run to run by the seed.
"""

import sys
import tempfile
from pathlib import Path
from time import process_time

import mujoco
import numpy as np

from idbench.experiments.requests.jobs import ServoRequest
from idbench.experiments.servo.job import servos_identified

RUNS, HOLD, SECONDS = 100, 0.01, 16.0

LINK = """<body pos="0 0 {z}"><joint name="j{k}" axis="{axis}" range="-2 2" armature="{Ia}" damping="{Fv}" frictionloss="{Fs}"/>
  <inertial pos="0.02 0.01 {com}" mass="{mass}" diaginertia="{I} {I} {I}"/>"""


def chain(rng, axes, mass, length, joints, actuators, option):
    """Return the MJCF of a hanging chain, masses by chance within a fifth, and the truth by joint."""
    text, truth = "", {}
    for k, (axis, m) in enumerate(zip(axes, mass * rng.uniform(0.8, 1.2, len(axes)), strict=True), 1):
        of = dict(zip(("Ia", "Fv", "Fs"), joints[min(k, len(joints)) - 1], strict=True))
        text += LINK.format(z=0 if k == 1 else -length, k=k, axis=axis, com=-length / 2, mass=m, I=m * length**2 / 12, **of)
        truth[f"j{k}"] = {**of, "delay": 0.0, "offset": 0.0, "bias": 0.0}
    blocks = "".join(actuators(k) for k in range(1, len(axes) + 1))
    close = "</body>" * len(axes)
    head = f'<compiler angle="radian"/><option {option}/>'
    return f"<mujoco>{head}<worldbody>{text}{close}</worldbody><actuator>{blocks}</actuator></mujoco>", truth


def commands(rng, n, t, reach):
    """Return sines with rests and steps, shape (time, joint), within a reach of each joint [rad]."""
    f, size, phase = rng.uniform(0.2, 1.6, (n, 4)), rng.uniform(0.3, 1.0, (n, 4)), rng.uniform(0, 6.28, (n, 4))
    waves = np.sum(size * (np.sin(2 * np.pi * f * t[:, None, None] + phase) - np.sin(phase)), axis=-1)
    steps = rng.uniform(-1, 1, (len(t), n))[(t / 0.8).astype(int)]
    return reach * np.where((t > SECONDS / 2)[:, None], steps, waves / 3)


def log_of(folder, name, xml, rng, reach, bits, *, pd=None, early=0.0):
    """Write a log as a plain script makes it; `pd` closes the loop in the script, kp, kd and limit of all joints."""
    model = mujoco.MjModel.from_xml_string(xml)
    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONTACT)
    data, h = mujoco.MjData(model), model.opt.timestep
    t = np.arange(0, SECONDS, HOLD)
    u = commands(rng, model.nv, t, reach)
    rows, every = [], round(HOLD / h)
    for k in range(len(t) * every):
        now = max(0, int((k * h - early) / HOLD + 1e-9)) if k * h >= early else 0
        if k % every == 0:
            rows.append([t[k // every], *data.qpos, *u[k // every]])
        data.ctrl = u[now] if pd is None else np.clip(pd[0] * (u[now] - data.qpos) - pd[1] * data.qvel, -pd[2], pd[2])
        mujoco.mj_step(model, data)
    table, n, step = np.array(rows), model.nv, 2 * np.pi / 2**bits
    table[:, 1 : 1 + n] = np.rint(table[:, 1 : 1 + n] / step) * step
    columns = ["t", *(f"q_j{k + 1}" for k in range(n)), *(f"command_j{k + 1}" for k in range(n))]
    np.savetxt(folder / name, table, delimiter=",", header=",".join(columns), comments="", fmt="%.9g")


def position(kp, kv, most):
    return lambda k: f'<position joint="j{k}" kp="{kp[k - 1]}" kv="{kv[k - 1]}" forcerange="-{most[k - 1]} {most[k - 1]}"/>'


def leg(rng, folder):
    """Torque PD in the script, 25 N m/rad and 0.6 N m s/rad, as of a small quadruped."""
    axes, option = ("1 0 0", "0 1 0", "0 1 0"), 'timestep="0.002"'
    motor = lambda k: f'<motor joint="j{k}"/>'  # noqa: E731
    xml, truth = chain(rng, axes, (0.7, 1.1, 0.2), 0.2, [(0.01, 0.3, 0.2)], motor, option)
    (folder / "servo.toml").write_text('kind = "torque"\nkp = 25\nkd = 0.6\ntorque_limit = 24\n')
    return xml, truth, {"pd": (25, 0.6, 24), "reach": 0.5, "bits": 14}, {"servo": folder / "servo.toml", "simulated": True}


def arm(integrator):
    def made(rng, folder):
        axes = ("0 0 1", "0 1 0", "0 1 0", "1 0 0", "0 1 0", "1 0 0")
        kp, kv, most = (400, 600, 400, 150, 100, 50), (30, 40, 30, 8, 5, 2), (90, 90, 60, 20, 15, 9)
        joints = [(0.2, 3, 1.5), (0.2, 3, 1.5), (0.1, 2, 1), (0.03, 0.5, 0.3), (0.02, 0.4, 0.2), (0.01, 0.2, 0.1)]
        option = f'timestep="0.002" integrator="{integrator}"'
        xml, truth = chain(rng, axes, (2, 2.5, 2, 1, 0.8, 0.4), 0.2, joints, position(kp, kv, most), option)
        return xml, truth, {"reach": 0.4, "bits": 14}, {"simulated": True}

    return made


def bench(rng, folder):
    """A DC motor behind a voltage, with a mass whose gravity is four times the friction."""
    a, b, V, limit, duty, kp = 0.58, 1.25, 12.0, 0.97, 0.166, 16
    K = b / a
    gains = f"{duty * kp * V * a} 0 {b} 4.8 0 {limit * V}"
    motor = lambda k: (  # noqa: E731
        f'<dcmotor joint="j{k}" motorconst="{K}" resistance="{K / a}" input="pos" controller="{gains}"/>'
    )
    # Dry friction as sharp as a real joint's: MuJoCo's own lets it creep under its load.
    sharp = '<default><joint solreffriction="0.0001 1" solimpfriction="0.9999 0.9999 0.001 0.5 2"/></default>'
    xml, truth = chain(
        rng, ("0 1 0",), (0.74,), 0.2, [(0.025, 0.0, 0.18)], motor, 'timestep="0.0001" integrator="implicitfast"'
    )
    xml = xml.replace("<worldbody>", f"{sharp}<worldbody>")
    (folder / "servo.toml").write_text(f'model = "STS3215"\nsupply = {V}\nkp = {kp}\n')
    known = {"a": a, "b": b, "rate": 4.8}
    for of in truth.values():
        of |= {**known, "Ia": of["Ia"] + b * 1e-4, "delay": 0.015 - 1.3e-4}  # see docs/servo.md, MuJoCo's own servos
        del of["Fv"], of["bias"]
    return xml, truth, {"reach": 0.9, "bits": 12, "early": 0.015}, {"servo": folder / "servo.toml"}


KINDS = {"leg": leg, "arm-euler": arm("Euler"), "arm-implicit": arm("implicitfast"), "bench": bench}


def run(kind, seed):
    """Return differences from the truth in sigma, and differences, by joint and letter, and the seconds of a fit."""
    rng = np.random.default_rng(seed)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        xml, truth, how, asked = KINDS[kind](rng, folder)
        (folder / "robot.xml").write_text(xml)
        log_of(folder, "log.csv", xml, rng, **how)
        begin = process_time()
        made = servos_identified(
            ServoRequest(log=(folder / "log.csv",), robot=str(folder / "robot.xml"), friction="coulomb", **asked)
        )
        seconds = process_time() - begin
    found = []
    for joint, fit in made.fits.items():
        sigma = fit.standard_errors
        for letter, true in truth[joint].items():
            if letter in sigma:
                found.append((letter, (fit.p[letter] - true) / max(sigma[letter], 1e-300), fit.p[letter] - true))
    return found, seconds


def main():
    """Print a table."""
    runs = int(sys.argv[1]) if len(sys.argv) > 1 else RUNS
    for kind in sys.argv[2:] or KINDS:
        results = [run(kind, seed) for seed in range(runs)]
        rows = [row for found, _ in results for row in found]
        letters = dict.fromkeys(letter for letter, *_ in rows)
        z = {x: np.array([z for letter, z, _ in rows if letter == x]) for x in letters}
        off = {x: np.array([d for letter, _, d in rows if letter == x]) for x in letters}
        each = "  ".join(f"{x} {100 * np.mean(np.abs(z[x]) < 2):.0f} % ({np.sqrt(np.mean(off[x] ** 2)):.2g})" for x in letters)
        every = np.concatenate(list(z.values()))
        seconds = np.median([s for _, s in results])
        delay = 1e3 * np.abs(off["delay"]).max() if "delay" in off else np.nan
        inside = f"within two sigma {100 * np.mean(np.abs(every) < 2):.1f} %"
        print(f"{kind}: {runs} runs, {inside}, {seconds:.0f} s of CPU a run, delay within {delay:.2g} ms")
        print(f"  {each}", flush=True)


if __name__ == "__main__":
    main()
