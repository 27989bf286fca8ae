"""The laws of friction that suit logs, and why."""

from collections.abc import Sequence
from dataclasses import asdict, replace
from math import isfinite
from typing import Any

from experiments.identification.friction_laws import COMPARED, law_of
from experiments.identification.identified import Identified
from identify import Problem
from identify.blame import blamed
from identify.judge.friction_choice import FrictionChoice, choose_friction
from identify.models.explicit import ExplicitModel


def with_suitable_friction(found: Identified, most: int | None = None) -> tuple[Identified, FrictionChoice]:
    """Return the identification with the laws of friction that predict motion best that was not fitted, joint by joint.

    At most so many are added to a joint.
    """
    subject = found.subject
    candidates = {name: law_of(name) for name in COMPARED if name != "temperature" or "temperature" in found.logs[0].conditions}
    with blamed():
        problem = Problem(found.logs, subject.basis, ExplicitModel(), found.processing)
        choice = choose_friction(problem, candidates, most=most)
    laws = subject.laws.with_more(choice.laws)
    asked = replace(subject.asked, friction=laws.texts)
    truth = (
        None
        if found.truth is None
        else {name: found.truth.get(name, 0.0) for name in replace(subject, asked=asked).basis.names}
    )
    return replace(found, subject=replace(subject, asked=asked), truth=truth), choice


def words(choice: FrictionChoice, laws: Sequence[Sequence[str]], joints: Sequence[str]) -> list[str]:
    """Return which laws each joint has, and what they take of its squared error on motion that was not fitted."""
    said = []
    for j, joint in enumerate(joints):
        taken = {score.law: score for score in choice.scores if score.joint == j and score.taken}
        why = ", ".join(f"{law} takes {100 * score.share:.0f} %" for law, score in taken.items())
        said.append(
            f"friction of {joint}: {' + '.join(laws[j])}"
            + (f" ({why} of the squared error of motion not fitted)" if why else "")
        )
    return said


def summary(choice: FrictionChoice) -> list[dict[str, Any]]:
    """Return what a summary.json says of what was compared."""
    return [{name: _finite(x) for name, x in (asdict(score) | {"joint": score.joint + 1}).items()} for score in choice.scores]


def _finite(x: Any) -> Any:
    return None if isinstance(x, float) and not isfinite(x) else x
