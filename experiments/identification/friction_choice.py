"""The laws of friction that suit logs, and why."""

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import asdict, replace
from typing import Any

import numpy as np

from idbench.experiments.identification.friction_laws import COMPARED, law_of
from idbench.experiments.identification.logs import Logs
from idbench.experiments.identification.request import Request
from idbench.experiments.results.writing import finite
from idbench.identify import MotionLog, Problem
from idbench.identify.arrays import TINY
from idbench.identify.basis.block import Parameter
from idbench.identify.basis.friction.shape import ShapedFriction
from idbench.identify.basis.of_joints import OfJoints
from idbench.identify.blame import blamed
from idbench.identify.estimators.settle import settled
from idbench.identify.judge.friction_choice import FrictionChoice, choose_friction
from idbench.identify.judge.ripples import likely_waves
from idbench.identify.models import ExplicitModel
from idbench.identify.rows.rows import Rows
from idbench.identify.signals.masks import NoMask
from idbench.identify.telling import stage

SHOWN = 0.02  # Share of the largest entry of a law's column that a mask must leave for the rows to show the law


def hidden_laws(before: Problem, after: Problem) -> tuple[str, ...]:
    """Parameters of laws that act in slow motion only, where a mask that reaches farther takes all that.

    Stribeck friction that no row shows could have any size, and would be added to the torque of slow motion.
    """
    basis, found = after.basis, list[str]()
    rows, usual = after.explicit.some_rows, before.explicit.some_rows
    for block in basis.blocks:
        inner, joints = (block.block, block.joints) if isinstance(block, OfJoints) else (block, range(basis.n))
        if not isinstance(inner, ShapedFriction):
            continue
        own = [p for p in basis.parameters if p.symbol in inner.letters() and p.joint in joints]
        sizes = {p.joint: _largest(rows, p) / max(_largest(usual, p), TINY) for p in own if p.symbol == inner.law.symbol}
        found += [p.name for p in own if sizes.get(p.joint, 1.0) < SHOWN]
    return tuple(found)


def _largest(rows: Rows, parameter: Parameter) -> float:
    """Return the largest entry of a column, by size."""
    return float(np.abs(rows.W[..., rows.names.index(parameter.name)]).max())


TURNS = 3  # How often laws of friction and delay are found in turns, at most


def chosen_friction(request: Request, logs: tuple[MotionLog, ...], most: int | None = None) -> tuple[Request, FrictionChoice]:
    """Return a request with the laws of friction that predict held-out motion best, joint by joint, and what was compared.

    At most so many are added to a joint.
    """
    robot_model = request.robot_model
    seen = {"temperature": "temperature" in logs[0].conditions, "tanh": isinstance(request.processing.mask, NoMask)}
    candidates = {name: law_of(name) for name in COMPARED if seen.get(name, True)}
    with blamed():
        problem = Problem(logs, robot_model.basis, ExplicitModel(), request.processing)
        choice = choose_friction(problem, {**candidates, **_ripples(problem)}, most=most)
    # A motor that turns with several joints has the laws that all of them have: theirs stay.
    turned = {j for coupling in robot_model.tree.couplings for j, weight in enumerate(coupling.weights) if weight}
    choice = replace(choice, idle=tuple(() if j in turned else own for j, own in enumerate(choice.idle)))
    asked = replace(
        robot_model.asked, friction=robot_model.laws.chosen(choice.laws, choice.idle).texts(robot_model.robot.joints)
    )
    return replace(request, robot_model=replace(robot_model, asked=asked)), choice


def _ripples(problem: Problem) -> dict[str, OfJoints]:
    """Cogging of the waves that residuals of each hinge have most of."""
    cutoff = problem.own_chain.cutoff
    if cutoff is None or problem.long or problem.logs[0].poses:
        return {}
    e = problem.rows.Y - problem.rows.predicted(problem.factors.fit(2).X)
    joints = defaultdict[str, list[int]](list)
    sizes = [np.ones(part.signals.state.q.shape) for part in problem.parts]
    for j, k in likely_waves(problem.parts, e, sizes, cutoff, problem.basis.hinges, apart=0):
        joints[f"cogging:{k}"].append(j)
    return {name: OfJoints(law_of(name), tuple(own)) for name, own in joints.items()}


def chosen_in_turns(request: Request, logs: Logs) -> tuple[Request, Logs, FrictionChoice]:
    """Return a request with the laws of friction that suit the logs, and these with the delay that goes with the laws.

    Friction that is not in the model moves the delay, and a delay that is off hides friction: both are found in turns.
    """
    for _ in range(TURNS):
        with stage("laws of friction"):
            chosen, choice = chosen_friction(request, logs.fitted)
        if not logs.delay_sought or not any(score.taken for score in choice.scores):
            break
        with stage("the delay of the torques"):
            logs, moved = logs.delayed(settled(chosen.problem(logs.fitted)).basis, request.processing)
        if not moved:
            break
    return chosen, logs, choice


def words(choice: FrictionChoice, laws: Sequence[Sequence[str]], joints: Sequence[str]) -> list[str]:
    """Laws of each joint, and the share of its squared held-out error that they explain."""
    said = []
    for j, joint in enumerate(joints):
        taken = {score.law: score for score in choice.scores if score.joint == j and score.taken}
        instead = ", instead of coulomb" if choice.idle[j] else ""
        why = ", ".join(f"{law} explains {100 * score.share:.0f} %" for law, score in taken.items())
        said.append(
            f"friction of {joint}: {' + '.join(laws[j])}"
            + (f" ({why} of the squared error on held-out stretches{instead})" if why else "")
        )
    return said


def summary(choice: FrictionChoice) -> list[dict[str, Any]]:
    """Summary of the comparison."""
    rows = (asdict(score) | {"joint": score.joint + 1} for score in choice.scores)
    return [{name: finite(x) if isinstance(x, float) else x for name, x in row.items()} for row in rows]
