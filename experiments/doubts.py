"""What is suspicious about a log, or about what was identified from it."""

from collections.abc import Sequence

import numpy as np

from experiments.identified import Identified
from experiments.subject import Subject
from identify import Array, ExcitationError, IdentificationError, MotionLog, showing_moves
from sim.robot import Robot

WELL_EXPLAINED = 0.95
"""Share of a torque's variance that a model of the right robot explains on any log that is worth identifying."""

SLACK = 0.05
"""Positions may be beyond a range by this share of it: ranges of files are rounded."""

MOST_TURNS = 2.0
"""Turns from zero beyond which a joint without a range is suspected to be logged in degrees."""


def doubts_of_log(log: MotionLog, robot: Robot) -> list[str]:
    """Return what is suspicious about a log of a robot: degrees, positions out of range, power that comes out of the joints."""
    found, (low, high) = [], robot.ranges.T
    ends = np.array([log.q.min(axis=0), log.q.max(axis=0)])
    width = np.where(np.isfinite(high - low), high - low, 0.0)
    beyond = (ends[0] < low - SLACK * width) | (ends[1] > high + SLACK * width)
    turned = np.isinf(width) | (np.abs(ends).max(axis=0) > MOST_TURNS * 2 * np.pi)
    hinges = np.array([robot.model.jnt_type[j] == 3 for j in range(robot.n)])
    for j in np.flatnonzero(beyond | (turned & hinges)):
        at = f"{robot.joints[j]} goes from {ends[0, j]:.4g} to {ends[1, j]:.4g}"
        if hinges[j] and _fits_in_degrees(ends[:, j], low[j], high[j]):
            found.append(f"{at}: are positions logged in degrees? They must be in rad")
        elif beyond[j]:
            found.append(f"{at}, out of its range, {low[j]:.4g} to {high[j]:.4g}: are joints in the order of the robot's file?")
    return found


def _fits_in_degrees(ends: Array, low: float, high: float) -> bool:
    """Return whether positions span more than a joint can, and in degrees would not."""
    inside = np.deg2rad(ends[0]) >= low - SLACK and np.deg2rad(ends[1]) <= high + SLACK
    return bool(inside and ends[1] - ends[0] > min(high - low, MOST_TURNS * 2 * np.pi))


def doubts_of_result(found: Identified) -> list[str]:
    """Return what no healthy identification shows, and what the log hardly tells."""
    told = _sign(found)
    for name, estimate in found.estimates.items():
        friction = zip(found.basis.parameters, estimate.X, estimate.corrected_sigma, strict=True)
        negative = [p for p, x, sigma in friction if p.startswith(("F", "Ia")) and x < -2 * sigma]
        if negative and not told:
            told.append(f"{', '.join(negative)} below zero in the {name} model: is the torque's meaning or delay wrong?")
        poor = [f"{100 * share:.0f} % of tau{j + 1}" for j, share in enumerate(found.explained[name]) if share < WELL_EXPLAINED]
        if poor:
            told.append(f"the {name} model explains {', '.join(poor)}: are units, signs and the torque's delay right?")
    return [*told, *_hardly_told(found)]


def _sign(found: Identified) -> list[str]:
    """Return which torques have the wrong sign: those that drive their joint by friction."""
    model, estimate = next(iter(found.estimates.items()))
    X = dict(zip(found.basis.parameters, estimate.X, strict=True))
    sigma = dict(zip(found.basis.parameters, estimate.corrected_sigma, strict=True))
    frictions = [
        (X.get(f"Fv{j}", 0.0), X.get(f"Fs{j}", 0.0), 2 * sigma.get(f"Fs{j}", 0.0)) for j in range(1, found.basis.n + 1)
    ]
    wrong = [j for j, (Fv, Fs, least) in enumerate(frictions) if Fv < 0 and Fs < -least]
    if not wrong:
        return []
    joints = ", ".join(found.subject.robot.joints[j] for j in wrong)
    work = _work(found.logs[0])
    balance = f", and the torques of the log take out {-work:.3g} J in all" if work < 0 else ""
    return [
        f"friction drives {joints} in the {model} model{balance}: does the torque have the wrong sign (it must be that on "
        "the joint, positive where it speeds up a positive motion)?"
    ]


def _work(log: MotionLog) -> float:
    """Return the work of all torques [J]."""
    tau = log.tau * np.asarray(log.torque.gain)
    return float(np.sum((tau[1:] + tau[:-1]) / 2 * np.diff(log.q, axis=0)))


def _hardly_told(found: Identified) -> list[str]:
    """Return which base parameters the log does not tell from zero, and what would show them."""
    subject, (model, estimate) = found.subject, next(iter(found.estimates.items()))
    lost = np.abs(estimate.X) < 2 * estimate.corrected_sigma
    names = [name for name, poor in zip(found.basis.parameters, lost, strict=True) if poor]
    if subject.base is None or not names:
        return []
    return [f"not to be told from zero by this log ({model} model): {_moves(subject, names)}"]


def helpful_moves(error: IdentificationError, subject: Subject) -> list[str]:
    """Return which moves would show the parameters that an error names."""
    if subject.base is None or not isinstance(error, ExcitationError):
        return []
    words = str(error).split(":")[0].replace(",", " ").split()
    names = [name for name in subject.basis.parameters if name in words]
    return [_moves(subject, names)] if names else []


def _moves(subject: Subject, names: Sequence[str]) -> str:
    """Return parameters by the joints that show them when they move."""
    if subject.base is None:
        return ", ".join(names)
    moves: dict[tuple[int, ...], list[str]] = {}
    for name, joints in showing_moves(subject.tree, subject.base, names).items():
        moves.setdefault(joints, []).append(name)
    each = [f"{', '.join(shown)} (move {_joints(subject, joints)})" for joints, shown in sorted(moves.items(), key=_size)]
    return "; ".join(each)


def _size(move: tuple[tuple[int, ...], list[str]]) -> int:
    return len(move[0])


def _joints(subject: Subject, joints: Sequence[int]) -> str:
    return "all joints" if len(joints) == subject.robot.n > 1 else " with ".join(subject.robot.joints[j] for j in joints)
