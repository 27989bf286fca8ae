"""What is suspicious about what was identified from a log, and what would help."""

from collections.abc import Collection, Iterator, Mapping, Sequence

import numpy as np

from idbench.experiments.identification.fit import Fit
from idbench.experiments.identification.log_warnings import unlike_file, warnings_of_base
from idbench.experiments.identification.robot_model import RobotModel
from idbench.experiments.note import Note
from idbench.identify import brisk_shares, showing_moves
from idbench.identify.basis.block import NOT_NEGATIVE, Kind, named
from idbench.identify.data.motion_log import never_logged
from idbench.identify.judge.diagnosis import DRIVING
from idbench.sim.robot.robot import Robot
from idbench.sim.robot.time_steps import apparent_rotor_inertia
from idbench.sim.robot.tree import kinematic_tree, unmodelled

WELL_EXPLAINED = 0.95
"""Share of a torque's variance that a model of the right robot explains on any log that is worth identifying."""

USELESS = 0.5
"""Share of a torque that one sigma of the parameters may make before the estimate is called useless; what is recommended
instead makes a fifth of it at most."""

ENOUGH = 4  # Rows for each parameter beyond which a large sigma is no matter of too few of them
MUCH_LONGER = 100  # Times from which on the length of a log is not what is wrong with it
FAR = 4.0  # Errors of more than so many sigma are marked: normal ones come once in 16 000
WEAK = 0.5  # Share of its value that the sigma of a parameter may have before it is marked as weak
ALIKE = 0.1  # Share of what an integrator makes of damping by which rotors of a simulation differ from the file's beside that
SIGNIFICANT = 2.0  # A value this many of the estimator's own sigma below zero that cannot be is a mistake, not an error
LINK_SIDE = 3.0  # A rotor's inertia this many sigma below zero is impossible: the torques do not contain the rotor
OPEN = 0.02  # Share of a joint's torque on a brisk motion that one sigma of a parameter may make before it counts as left open


LOG = "the log"
DELAY = "the torque's delay"
FILE = "the robot's file"
MOTION = "the motion"
MODEL = "the model"  # Subjects of warnings, in the order in which to check them: the first may cause the others


def warnings_of_result(fit: Fit) -> dict[str, list[str]]:
    """Symptoms of a bad identification, and parameters that the log leaves open, by subject."""
    log = [*wrong_sign(fit), *unlike_file(fit), *_seems_simulated(fit)]
    name, motion = fit.leading, list(_too_little(fit, fit.leading))
    model = [] if log else list(_link_side(fit))
    if (negative := _negative(fit, name)) and not log and not model:
        model.append(f"{', '.join(negative)} below zero in the {name} model: is the torque's meaning or delay wrong?")
    model += [] if motion else _badly_explained(fit, name)
    return {LOG: log, MOTION: motion if log or motion or model else _poorly_known(fit), MODEL: model}


def _seems_simulated(fit: Fit) -> Iterator[str]:
    """Yield whether rotors are larger than the file's by what MuJoCo's integrator makes of the file's own damping."""
    robot, estimate = fit.robot_model.robot, fit.estimates[fit.leading]
    inertia = apparent_rotor_inertia(robot)
    found = dict(zip(estimate.names, estimate.X, strict=True))
    own = [j for j in range(robot.n) if inertia[j] > 0 and named("Ia", j) in found]
    more = [(found[named("Ia", j)] - robot.model.dof_armature[j]) / inertia[j] for j in own]
    if len(own) > 1 and max(np.abs(np.array(more) - 1)) < ALIKE:
        yield Note(
            f"rotors are larger than the file's by {' '.join(f'{inertia[j]:.3g}' for j in own)} kg m^2, which the integrator "
            "of a MuJoCo simulation of it makes of its damping: is this log of one? Then add --simulated",
            option="--simulated",
        )


def _link_side(fit: Fit) -> Iterator[str]:
    """Yield whether torques look like those of the links, behind gears and rotors: these take rotors out, as it were."""
    if rotors := _negative(fit, fit.leading, {"rotor inertia"}, LINK_SIDE):
        yield (
            f"{', '.join(rotors)} more than {LINK_SIDE:g} sigma below zero: are these torques measured at the links, behind "
            "the gears? Then add --armature none; if not, their meaning or delay is wrong"
        )


FLAGS = {
    "!": "below zero, but must be positive",
    "*": f"off by more than {FAR:g} sigma",
    "?": f"sigma above {100 * WEAK:g} % of its value",
}
"""What is doubtful of a parameter."""


def doubtful(fit: Fit) -> dict[str, list[tuple[str, str, str]]]:
    """Return, of each model, a mark for every parameter's estimate, its error and its sigma; blank where nothing is wrong."""
    marks = {}
    for model, estimate in fit.estimates.items():
        negative, sigma = _negative(fit, model), estimate.standard_errors
        off = np.zeros(len(sigma)) if fit.truth is None else np.abs(estimate.X - list(fit.truth.values()))
        marks[model] = [
            ("!" if name in negative else " ", "*" if error > FAR * s > 0 else " ", "?" if s > WEAK * abs(x) else " ")
            for name, x, error, s in zip(estimate.names, estimate.X, off, sigma, strict=True)
        ]
    return marks


def used(marks: Mapping[str, Sequence[Sequence[str]]]) -> list[str]:
    """Return the flags that occur among the marks of all models, in the order of `FLAGS`."""
    there = {mark for of_model in marks.values() for of_row in of_model for mark in of_row}
    return [flag for flag in FLAGS if flag in there]


def _negative(fit: Fit, model: str, kinds: Collection[Kind] = NOT_NEGATIVE, times: float = SIGNIFICANT) -> list[str]:
    """Return parameters of kinds that must be positive and are significantly negative, by so many sigma."""
    estimate = fit.estimates[model]
    values = zip(fit.basis.parameters, estimate.X, estimate.own_sigma, strict=True)
    return [p.name for p, x, sigma in values if p.kind in kinds and x < -times * sigma]


def _too_little(fit: Fit, name: str) -> Iterator[str]:
    """Yield why an estimate says nothing, where its sigma alone makes much of a torque, and what would help."""
    estimate, shares = fit.estimates[name], fit.left_open[name]
    worst = int(np.nan_to_num(shares, nan=np.inf).argmax())
    if shares[worst] < USELESS or estimate.row_count > ENOUGH * len(estimate.names):  # else it is the model that is wrong
        return
    others = [other for other, open_ in fit.left_open.items() if np.nan_to_num(open_, nan=np.inf).max() < USELESS / 5]
    times = min(1000, int(np.ceil((shares[worst] / (USELESS / 5)) ** 2))) if np.isfinite(shares[worst]) else 1000
    longer = f"a log {times} times as long" if times < MUCH_LONGER else "a log that moves all joints, and longer"
    yield (
        f"the {name} model identifies too little: {int(estimate.row_count)} rows for {len(estimate.names)} parameters, Cond(W) "
        f"{float(estimate.condition_number):.2g}, one sigma of its parameters makes {100 * shares[worst]:.0f} % of the torque "
        f"of {fit.robot_model.robot.joints[worst]}: take {f'the {others[0]} model' if others else longer}"
        + (f", or {longer}" if others else "")
    )


def _badly_explained(fit: Fit, name: str) -> Iterator[str]:
    """Yield which torques a model does not explain: the log is suspected, unless another model explains them."""
    joints = fit.robot_model.robot.joints
    shares = dict(enumerate(fit.explained[name]))
    still = set.intersection(*({*log.unchanging, *log.missing} for log in fit.logs.fitted))
    if nothing := [joints[j] for j, share in shares.items() if np.isnan(share) and j not in still]:
        yield (
            f"no torque of {', '.join(nothing)} is left to explain, the mask leaves no row: nothing is identified of it, "
            "move it faster"
        )
    poor = {j: share for j, share in shares.items() if share < WELL_EXPLAINED}
    if not poor or fit.logs.fitted[0].poses:
        return
    sizes = {j: f"{100 * share:.0f} %" if share > 0 else "nothing" for j, share in poor.items()}
    poorly = ", ".join(f"{size} of tau{j + 1}" for j, size in sizes.items())
    if others := [o for o, shares in fit.explained.items() if all(shares[j] >= WELL_EXPLAINED for j in poor)]:
        yield (
            f"the {name} model explains {poorly}, where the {others[0]} model explains at least {100 * WELL_EXPLAINED:.0f} %: "
            f"noise of the velocities, or too little motion of {', '.join(joints[j] for j in poor)}; take the {others[0]} model"
        )
    else:
        yield f"the {name} model explains {poorly}: are units, signs, order of columns and the torque's delay right?"


def hidden_notes(fit: Fit) -> list[str]:
    """Parameters that the logs do not show, and motions that would."""
    if not fit.hidden:
        return []
    robot, absent = fit.robot_model, never_logged(fit.logs.fitted)
    unlogged = {p.name for p in robot.grouping.standard.parameters if p.joint in absent}
    lost = [name for name in fit.hidden if name in unlogged]
    still = [name for name in fit.hidden if name not in unlogged]
    joints = ", ".join(robot.robot.joints[j] for j in absent)
    notes = [f"without the torque of {joints}, {', '.join(lost)} are not shown: left out, as if zero"] if lost else []
    if not still:
        return notes
    at_rest = ", ".join(fit.still)
    moves = f"{at_rest} never moves in this log: move it" if at_rest else _moves(robot, still)
    why = f" ({moves})" if moves else ""
    return [*notes, f"this log does not excite {', '.join(still)}: left out, as if zero{why}"]


def warnings_of_robot(robot: Robot) -> list[str]:
    """Parts of a robot's file that no parameter describes, and repairs of it."""
    return [*undescribed(robot), *(f"the file of robot {robot.name!r} has {note}" for note in robot.notes)]


def undescribed(robot: Robot) -> list[str]:
    """Parts of a robot's file that no parameter describes."""
    found = unmodelled(robot)
    messages = [f"the file of robot {robot.name!r} has {', '.join(found)}, which no parameter describes"] if found else []
    return [*messages, *warnings_of_base(kinematic_tree(robot))]


def wrong_sign(fit: Fit) -> list[Note]:
    """Torques with the wrong sign: those whose friction drives their joint."""
    model, estimate = next(iter(fit.estimates.items()))
    values = zip(fit.basis.parameters, estimate.X, estimate.own_sigma, strict=True)
    known, wrong = {(p.kind, p.joint): (x, sigma) for p, x, sigma in values}, list[str]()
    for j, joint in enumerate(fit.robot_model.robot.joints):
        (viscous, _), (coulomb, sigma) = (known.get((kind, j), (0.0, 0.0)) for kind in DRIVING)
        if viscous < 0 and coulomb < -SIGNIFICANT * sigma:
            wrong.append(joint)
    if not wrong:
        return []
    log = fit.logs.fitted[0]
    tau = log.tau * np.asarray(log.torque.gain)
    work = float(np.sum((tau[1:] + tau[:-1]) / 2 * np.diff(log.q, axis=0)))  # of all torques [J]
    balance = f", and the torques of the log take out {-work:.3g} J in all" if work < 0 else ""
    finding = f"friction drives {', '.join(wrong)} in the {model} model{balance}"
    asked = "does the torque have the wrong sign (it must be that on the joint, positive where it speeds up a positive motion)?"
    return [Note(f"{finding}: {asked}", finding=finding)]


def _poorly_known(fit: Fit) -> list[str]:
    """Base parameters of which one sigma shows in the torque of a brisk motion, and the moves to make.

    By the part of sigma due to noise: another motion does not mend the model.
    """
    robot_model, (model, estimate) = fit.robot_model, next(iter(fit.estimates.items()))
    shares = brisk_shares(robot_model.tree, fit.basis, estimate.X, estimate.noise_sigma)
    of_laws = [not p.is_random_effect for p in fit.basis.parameters]
    names = [name for name, share, law in zip(fit.basis.names, shares, of_laws, strict=True) if share > OPEN and law]
    if not names:
        return []
    return [f"poorly known in the {model} model (one sigma above {100 * OPEN:g} % of a brisk motion's torque): "
            f"{_moves(robot_model, names)}"]  # fmt: skip


def _moves(robot_model: RobotModel, names: Sequence[str]) -> str:
    """Return parameters by the joints that show them when they move."""
    moves: dict[tuple[int, ...], list[str]] = {}
    for name, joints in showing_moves(robot_model.tree, robot_model.grouping, names).items():
        moves.setdefault(joints, []).append(name)
    robot, few_first = robot_model.robot, sorted(moves.items(), key=lambda move: len(move[0]))
    words = {js: "all joints" if len(js) == robot.n > 1 else " with ".join(robot.joints[j] for j in js) for js in moves}
    return "; ".join(f"{', '.join(shown)} (move {words[joints]})" for joints, shown in few_first)
