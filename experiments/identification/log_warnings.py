"""What is suspicious about a log before anything is made of it."""

from collections.abc import Iterator

import numpy as np

from idbench.experiments.identification.fit import Fit
from idbench.experiments.note import Note, noted
from idbench.identify import Array, Joint, KinematicTree, MotionLog, Problem
from idbench.identify.basis.block import FRICTION, RIGID, Kind
from idbench.identify.data.jumps import Jump, dropouts, jumps
from idbench.identify.data.kinematics import GROUND
from idbench.identify.judge.diagnosis import DROPOUTS

FAR_OFF = 30.0  # Factor between measured and expected torques that no missing rotor makes in the joint that carries most

PARTS: dict[str, frozenset[Kind]] = {"friction": FRICTION, "links and rotors": RIGID}
"""What of a file makes torques, and by which parameters."""


def unlike_file(fit: Fit) -> list[str]:
    """True if torques are far from what the robot's file says of the same motion, as those in other units are.

    If only friction is, or only what has inertia, that is said: the file has placeholders.
    """
    robot_model, R = fit.robot_model, without_shapes(fit.problem)
    if robot_model.robot.weightless:
        return []
    filed = np.array(list(robot_model.truth(robot_model.robot).values()))
    expected = np.linalg.norm(R[..., :-1] @ filed, axis=-1)
    j = int(np.argmax(expected))  # the joint of which the file expects most
    measured = float(np.linalg.norm(R[j, ..., -1]))
    if not expected[j] or not _far(measured / expected[j]):
        return []
    X = next(iter(fit.estimates.values())).X
    every = {part: _torques(fit, R[j, ..., :-1], kinds, X, filed) for part, kinds in PARTS.items()}
    ratios = {part: float(found / stated) for part, (found, stated) in every.items() if stated}
    words = f"the torques are {measured / expected[j]:.2g} times what the robot's file says of this motion"
    far = [part for part, ratio in ratios.items() if _far(ratio)]
    unstated = [part for part, (found, stated) in every.items() if not stated and found]
    if not far:  # what the file does not state makes the rest
        return []
    if len(far) == len(ratios) and not unstated:
        return [f"{words}: are they in N m?"]
    each = ", ".join(f"its {part} {ratio:.2g} times" for part, ratio in ratios.items())
    return [f"{words}, {each} at {robot_model.robot.joints[j]}: are the file's values of {' and '.join(far)} placeholders?"]


def without_shapes(problem: Problem) -> Array:
    """Return R of the measured torques: rows of laws that are linear about an estimate contain what that makes of these."""
    R = problem.factors.R.copy()
    for place, value in problem.basis.operating_point.items():
        R[..., -1] -= R[..., place] * value
        R[..., place] = 0.0
    return R


def _far(ratio: float) -> bool:
    return not 1 / FAR_OFF < ratio < FAR_OFF


def _torques(fit: Fit, R: Array, kinds: frozenset[Kind], X: Array, filed: Array) -> tuple[float, float]:
    """Return the size of the torques that some parameters make, as estimated and by the file."""
    chosen = np.array([parameter.kind in kinds for parameter in fit.basis.parameters])
    found, stated = (float(np.linalg.norm(R @ np.where(chosen, values, 0.0))) for values in (X, filed))
    return found, stated


SLACK = 0.05  # Positions may be beyond a range by this share of it: ranges of files are rounded

MOST_TURNS = 2.0
"""Turns of a hinge between the ends of a log beyond which degrees are suspected, where the robot gives it no range."""

HARDLY = 0.02  # Share of its range below which a joint hardly moves
MOST_JUMPS = 3  # Jumps of a log that are named
JUMPS = "jumps"  # What some warnings of logs are about


def warnings_of_log(log: MotionLog, tree: KinematicTree) -> list[str]:
    """Suspicions about a log: jumps, degrees, millimetres, places that a joint cannot reach, joints at rest."""
    found = list(_of_jumps(log, tree))
    jumping = {jump.joint for jump in jumps_of(log)}
    by_reason = dict[str, list[str]]()
    for j, (joint, q) in enumerate(zip(tree.joints, log.q.reshape(-1, log.n).T, strict=True)):
        ends = np.array([q.min(), q.max()])
        if j not in jumping and (reason := _reason(joint, ends)):
            by_reason.setdefault(reason, []).append(f"{joint.name} goes from {ends[0]:.4g} to {ends[1]:.4g}")
    return found + [
        Note(f"{', '.join(each)}{reason}", option=noted(reason).option) for reason, each in by_reason.items()
    ]  # all joints in degrees are one line


def unchanging(log: MotionLog, tree: KinematicTree) -> list[str]:
    """Torques that never change: nobody drives the joint, or its torque was not logged, as rows of a fit show."""
    dead = ", ".join(tree.joints[j].name for j in log.unchanging)
    return [f"the torque of {dead} never changes: is it logged?"] if dead else []


def jumps_of(log: MotionLog) -> list[Jump]:
    """Jumps of the positions of a log; of many runs, and of poses, none are looked for."""
    return jumps(log.q, log.fs) if log.q.ndim == 2 and not log.poses else []


def _of_jumps(log: MotionLog, tree: KinematicTree) -> Iterator[str]:
    """Yield the first jumps of a log, by joint, sample and speed."""
    every = jumps_of(log)
    if dropouts(every) >= DROPOUTS:
        first, k = tree.joints[every[0].joint].name, every[0].sample
        yield Note(
            f"{len(every)} jumps, the first of {first} at sample {k} ({k / log.fs:.4g} s): samples were dropped, "
            "held or repeated; log without dropouts, or identify a part that has none; no further advice before",
            about=JUMPS,
        )
        return
    for jump in every[:MOST_JUMPS]:
        slide = tree.joints[jump.joint].kind == "slide"
        unit, k = "m" if slide else "rad", jump.sample
        how = (
            "and back: a wild sample; correct it or cut it out"
            if jump.back
            else f"and stays there: did its encoder slip, or was it homed anew? Identify samples 0 to {k - 1}, or those after"
        )
        yield Note(
            f"{tree.joints[jump.joint].name} jumps by {jump.size:.3g} {unit} at sample {k} ({k / log.fs:.4g} s), "
            f"{jump.speed:.3g} {unit}/s where 99 % of the log is slower than {jump.usual:.3g}, {how}",
            about=JUMPS,
        )
    if len(every) > MOST_JUMPS:
        yield f"and {len(every) - MOST_JUMPS} more such jumps"
    if every:
        yield "a log with jumps gets no further advice: mend them first"


def _reason(joint: Joint, ends: Array) -> str:
    low, high = joint.range
    slack = SLACK * (high - low) if np.isfinite(high - low) else SLACK
    span, room = float(np.ptp(ends)), min(high - low, MOST_TURNS * 2 * np.pi if joint.kind == "hinge" else np.inf)
    hinge = joint.kind == "hinge"
    unit, other, option, scale = ("rad", "degrees", "deg", np.pi / 180) if hinge else ("m", "millimetres", "mm", 1e-3)
    # In the other unit a joint moves farther than any does in its own.
    if span > 3 * room and scale * ends[0] >= low - slack and scale * ends[1] <= high + slack:
        return Note(f": are positions logged in {other}? Then add --units q={option}", option=f"--units q={option}")
    if ends[0] < low - slack or ends[1] > high + slack:
        order = "are joints in the order of the robot's file, and counted from its zero in its direction?"
        return f", out of its range, {low:.4g} to {high:.4g}: {order}"
    if span < HARDLY * room and np.isfinite(room):
        return (
            f", by {span:.2g} {unit} in all: it hardly moves, so that little of it can be identified; move it more, or correct "
            f"the unit if its positions are in {unit} already where {other} are stated"
        )
    return ""


def warnings_of_base(tree: KinematicTree) -> list[str]:
    """True if a robot looks like one that is not fixed to the ground: legs and rotors start there."""
    first = [joint.name for joint in tree.joints if joint.parent == GROUND]
    if len(first) == 1:
        return []
    return [
        f"{len(first)} chains of joints start at the ground ({', '.join(first[:4])}{', ...' if len(first) > 4 else ''}): the "
        "robot is taken as fixed there; if it walks, drives or flies, its base makes torques that no parameter describes"
    ]
