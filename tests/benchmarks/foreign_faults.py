"""How often the doctor names the right cause and joint: every fault of a scenario, on robots that no test was made with.

    uv run python tests/benchmarks/foreign_faults.py [ROBOT ...]

A leg, a SCARA with a slide, a palletizer, a gripper, and the two links and the PUMA that ship; 24 s of five sines at 100 Hz,
17 bits, 2 % of white torque noise. The joint in the middle has the fault. A log can show one if it takes more than 40 of minus
twice the logarithm of the likelihood. Right is the cause that is named first, or one of the rivals printed with it.
"""

import argparse
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parent.parent / "identify"))

from faulty_logs import WHEN, less_explained, sizes

import idbench
from idbench.experiments.study.named_faults import is_named
from idbench.identify import MotionLog, TorqueChannel
from idbench.sim.robot.inverse_dynamics import coulomb_torque, inverse_dynamics
from idbench.sim.robot.robot import Robot
from idbench.sim.scenario.faults import FAULTS, Fault, with_faults

FS, SECONDS, BITS, NOISE, SHOWN = 100.0, 24.0, 17, 0.02, 40.0

LINKS = {
    "leg": (
        "roll hinge 1,0,0 0,0,.8 -1.5,1.5 .02,.03,-.02 2.5 .012,.01,.011",
        "hip hinge 0,1,0 .04,.06,0 -2,2 .01,.02,-.14 3.2 .035,.034,.006",
        "knee hinge 0,1,0 0,.03,-.32 -2.4,2.4 .015,.01,-.13 1.4 .014,.0135,.002",
    ),
    "scara4": (
        "shoulder hinge 0,0,1 0,0,.4 -2.5,2.5 .18,.01,0 6 .03,.09,.1",
        "elbow hinge 0,0,1 .35,0,0 -2.4,2.4 .14,.02,0 4 .015,.05,.055",
        "slide slide 0,0,1 .3,0,0 -.15,.15 .02,.01,-.1 1.5 .008,.008,.002",
        "wrist hinge 0,0,1 0,0,-.2 -3,3 .03,.015,-.05 .8 .002,.002,.0015",
    ),
    "palletizer": (
        "base hinge 0,0,1 0,0,.3 -2.8,2.8 .05,.02,.1 20 .4,.4,.3",
        "lower hinge 0,1,0 .15,0,.2 -1.5,1.5 .02,.03,.3 15 .5,.5,.06",
        "upper hinge 0,1,0 0,0,.7 -1.5,1.5 .35,.02,.05 12 .06,.5,.5",
        "pitch hinge 0,1,0 .75,0,0 -1.5,1.5 .06,.01,-.03 3 .012,.015,.012",
        "yaw hinge 0,0,1 .1,0,-.1 -3,3 .02,.03,-.05 2 .008,.009,.007",
    ),
    "gripper": (
        "lift hinge 0,1,0 0,0,.5 -1.8,1.8 .15,.01,.02 2 .004,.03,.03",
        "turn hinge 1,0,0 .35,0,0 -2.8,2.8 .05,.01,.02 .8 .002,.003,.003",
        "left slide 0,1,0 .12,.02,0 0,.08 .02,.01,0 .25 .0002,.0002,.0002",
        "right slide 0,1,0 .02,-.12,0 -.08,.02 .02,-.01,0 .2 .0002,.0002,.0002",
    ),
}
"""Joints with type, axis, place, range, and the link's centre of mass, mass and moments of inertia."""

SHIPPED = ("two_link", "puma560")

OF_HINGES = {"zero", "eccentric", "degrees", "cogging", "commutation", "backlash", "elasticity"}
HIDDEN = {"rotor"}  # rotors are identified


def file_of(name: str, folder: Path) -> str:
    """Name of a robot that ships, or an MJCF file with rotors and friction of a tenth of what its links make."""
    if name in SHIPPED:
        return name
    text = ""
    for words in LINKS[name]:
        joint, kind, axis, place, span, centre, mass, moments = (word.replace(",", " ") for word in words.split(" "))
        m = float(mass)
        text += (
            f'<body pos="{place}"><joint name="{joint}" type="{kind}" axis="{axis}" range="{span}" limited="true" '
            f'armature="{m / 200:g}" damping="{m / 40:g}" frictionloss="{m / 20:g}"/>'
            f'<inertial pos="{centre}" mass="{mass}" diaginertia="{moments}"/>'
        )
    path = folder / f"{name}.xml"
    bodies = f"<worldbody>{text}{'</body>' * len(LINKS[name])}</worldbody>"
    path.write_text(f'<mujoco model="{name}"><compiler angle="radian"/>{bodies}</mujoco>')
    return str(path)


def motion(robot: Robot, seed: int):
    """Positions, velocities and accelerations of five sines a joint, shape (time, joint) each."""
    rng, t = np.random.default_rng(seed), np.arange(round(SECONDS * FS)) / FS
    w = 2 * np.pi * 0.1 * np.arange(1, 6)[:, None, None]
    a, b = rng.standard_normal((2, 5, robot.n, 1)) / np.arange(1, 6)[:, None, None]
    sin, cos = np.sin(w * t), np.cos(w * t)
    q = np.sum(a * sin + b * cos, axis=0)
    span = np.where(robot.model.jnt_limited[:, None], robot.model.jnt_range, [-2.0, 2.0])
    size = (np.minimum(0.4 * np.ptp(span, axis=1), 1.0) / np.abs(q).max(axis=1))[:, None]
    middle = np.clip(span.mean(axis=1), -1, 1)[:, None]
    qd, qdd = np.sum(w * (a * cos - b * sin), axis=0), -np.sum(w**2 * (a * sin + b * cos), axis=0)
    return (middle + size * q).T, (size * qd).T, (size * qdd).T


def run(name: str, folder: Path) -> list[tuple[bool, bool, bool, bool]]:
    """Print what is named of each fault; of each whether it is right, honest, false, and can be seen."""
    file = file_of(name, folder)
    robot = Robot.load(file)
    true, j, results = motion(robot, 1), robot.n // 2, []
    tau = inverse_dynamics(robot, *true) + coulomb_torque(robot, true[1])
    rng, step = np.random.default_rng(2), 2 * np.pi / 2**BITS
    noisy = tau + NOISE * np.std(tau, axis=0) * rng.standard_normal(tau.shape)
    log = MotionLog(FS, np.round(true[0] / step) * step, noisy, TorqueChannel("instantaneous"))
    clean = idbench.fit(log, file, armature="all").fit
    print(f"{name}: without a fault {[cause.short for cause in clean.diagnosis or ()] or 'none'}", flush=True)
    size, hinge = sizes(true, tau, float(robot.model.body_mass[-1]), j, SECONDS), robot.model.jnt_type[j] == 3
    for kind, flaw in FAULTS.items():
        if kind in HIDDEN or (kind in OF_HINGES and not hinge):
            continue
        fault = Fault(kind, size.get(kind, 0.0), "" if flaw.whole else robot.joints[j], *WHEN.get(kind, (0.0, None)))
        begin = time.perf_counter()
        wrong = with_faults(robot, log, true, (fault,), np.random.default_rng(3))
        try:
            fit = idbench.fit(wrong, file, armature="all").fit
        except idbench.IdbenchError as error:
            print(f"  {kind:20} refused: {error}"[:150], flush=True)
            continue
        found = fit.diagnosis or ()
        right = bool(found) and is_named(found[0].suspect, robot.joints, [fault])
        honest = not found or found[0].suspect.cause == "unknown"
        alike = fit.basis.names == clean.basis.names
        chi2 = less_explained(clean.problem, fit.problem) if alike else np.inf
        results.append((right, honest and not right, not right and not honest, chi2 > SHOWN or right))
        words = "; ".join(cause.words for cause in found[:2]) or "none"
        mark = "right" if right else "honest" if honest else "FALSE"
        print(f"  {kind:20} {mark:6} {chi2:8.0f} {time.perf_counter() - begin:5.1f} s  {words[:110]}", flush=True)
    return results


def main(argv: list[str] | None = None) -> None:
    """Run all robots that are asked for."""
    parser = argparse.ArgumentParser()
    parser.add_argument("robots", nargs="*", default=[*LINKS, *SHIPPED])
    asked = parser.parse_args(argv)
    with tempfile.TemporaryDirectory() as folder:
        every = [result for name in asked.robots for result in run(name, Path(folder))]
    right, honest, false, seen = (sum(column) for column in zip(*every, strict=True))
    print(f"{len(every)} logs with a fault, {seen} show it: right {right}, something else or nothing {honest}, false {false}")


if __name__ == "__main__":
    sys.exit(main())
