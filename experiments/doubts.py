"""What is suspicious about what was identified from a log, and what would help."""

from collections.abc import Mapping, Sequence

import numpy as np

from experiments.identified import Identified
from experiments.log_doubts import resting
from experiments.subject import Subject
from identify import Estimate, ExcitationError, IdentificationError, MotionLog, brisk_shares, showing_moves
from sim.robot import Robot
from sim.tree import unmodelled

WELL_EXPLAINED = 0.95
"""Share of a torque's variance that a model of the right robot explains on any log that is worth identifying."""

OPEN = 0.02
"""Share of a joint's torque on a brisk motion that one sigma of a parameter may make before it is said to be left open."""


def doubts_of_result(found: Identified) -> list[str]:
    """Return what no healthy identification shows, and what the log leaves open."""
    told = wrong_sign(found)
    for name, estimate in found.estimates.items():
        friction = zip(found.basis.parameters, estimate.X, estimate.corrected_sigma, strict=True)
        negative = [p for p, x, sigma in friction if p.startswith(("F", "Ia")) and x < -2 * sigma]
        if negative and not told:
            told.append(f"{', '.join(negative)} below zero in the {name} model: is the torque's meaning or delay wrong?")
        poor = [f"{100 * share:.0f} % of tau{j + 1}" for j, share in enumerate(found.explained[name]) if share < WELL_EXPLAINED]
        if poor:
            told.append(
                f"the {name} model explains {', '.join(poor)}: are units, signs, order of columns and the torque's delay right?"
            )
    return told or _left_open(found)


def doubts_of_robot(robot: Robot) -> list[str]:
    """Return what of a robot's file no parameter describes."""
    found = unmodelled(robot)
    return [f"the file of robot {robot.name!r} has {', '.join(found)}, which no parameter describes"] if found else []


def wrong_sign(found: Identified) -> list[str]:
    """Return which torques have the wrong sign: those that drive their joint by friction."""
    model, estimate = next(iter(found.estimates.items()))
    X, sigma = _named(estimate, estimate.X), _named(estimate, estimate.corrected_sigma)
    joints = found.subject.robot.joints
    wrong = [
        joint
        for j, joint in enumerate(joints, 1)
        if X.get(f"Fv{j}", 0.0) < 0 and X.get(f"Fs{j}", 0.0) < -2 * sigma.get(f"Fs{j}", 0.0)
    ]
    if not wrong:
        return []
    work = _work(found.logs[0])
    balance = f", and the torques of the log take out {-work:.3g} J in all" if work < 0 else ""
    return [
        f"friction drives {', '.join(wrong)} in the {model} model{balance}: does the torque have the wrong sign (it must be "
        "that on the joint, positive where it speeds up a positive motion)?"
    ]


def _named(estimate: Estimate, values: np.ndarray) -> Mapping[str, float]:
    return dict(zip(estimate.parameters, map(float, values), strict=True))


def _work(log: MotionLog) -> float:
    """Return the work of all torques [J]."""
    tau = log.tau * np.asarray(log.torque.gain)
    return float(np.sum((tau[1:] + tau[:-1]) / 2 * np.diff(log.q, axis=0)))


def _left_open(found: Identified) -> list[str]:
    """Return which base parameters the log leaves open so far that a brisk motion would show it, and what would tell them."""
    subject, (model, estimate) = found.subject, next(iter(found.estimates.items()))
    if subject.base is None:
        return []
    shares = brisk_shares(subject.tree, found.basis, estimate.X, estimate.corrected_sigma)
    names = [name for name, share in zip(found.basis.parameters, shares, strict=True) if share > OPEN]
    if not names:
        return []
    return [f"one sigma of these parameters is above {100 * OPEN:g} % of a brisk motion's torque ({model} model): "
            f"{_moves(subject, names)}"]  # fmt: skip


def helpful_moves(error: IdentificationError, subject: Subject, log: MotionLog) -> list[str]:
    """Return what would show the parameters that an error names: joints that never move, or else moves."""
    if not isinstance(error, ExcitationError):
        return []
    if still := resting(log, subject.tree):
        return [f"{', '.join(still)} never moves in this log: move it"]
    words = str(error).split(":")[0].replace(",", " ").split()
    names = [name for name in subject.basis.parameters if name in words]
    return [_moves(subject, names)] if names and subject.base is not None else []


def _moves(subject: Subject, names: Sequence[str]) -> str:
    """Return parameters by the joints that show them when they move."""
    moves: dict[tuple[int, ...], list[str]] = {}
    for name, joints in showing_moves(subject.tree, subject.grouping, names).items():
        moves.setdefault(joints, []).append(name)
    each = [f"{', '.join(shown)} (move {_joints(subject, joints)})" for joints, shown in sorted(moves.items(), key=_size)]
    return "; ".join(each)


def _size(move: tuple[tuple[int, ...], list[str]]) -> int:
    return len(move[0])


def _joints(subject: Subject, joints: Sequence[int]) -> str:
    return "all joints" if len(joints) == subject.robot.n > 1 else " with ".join(subject.robot.joints[j] for j in joints)
