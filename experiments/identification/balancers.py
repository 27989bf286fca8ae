"""Balancers as options state them: the joint, and the geometry of a drawing."""

from collections.abc import Sequence
from dataclasses import fields

from idbench.experiments.errors import ExperimentError
from idbench.experiments.identification.friction_laws import joint_of
from idbench.identify import KinematicTree, SettingError
from idbench.identify.basis import Balancer
from idbench.identify.plugins import did_you_mean

OPTION = "--balancer"
GEOMETRY = tuple(field.name for field in fields(Balancer) if field.name != "joint")
"""What is stated of a balancer."""

EXAMPLE = "2=a:0.2,b:0.8,zero:-1.66"


def balancers(texts: Sequence[str], tree: KinematicTree) -> tuple[Balancer, ...]:
    """Return the balancers that texts such as 2=a:0.2,b:0.8,zero:-1.66 state, for joint 2, in m and rad.

    Raises
    ------
    ExperimentError
        If a joint or a setting is unknown, a number is none, or a joint slides or has two.
    """
    found = dict[int, Balancer]()
    for text in texts:
        where, mark, words = text.partition("=")
        if not mark:
            raise ExperimentError(f"{OPTION} {text}: give a joint and the geometry [m, rad], such as {EXAMPLE}")
        joint = joint_of(f"{OPTION} {text}", where, [joint.name for joint in tree.joints])
        if tree.joints[joint].kind == "slide":
            raise ExperimentError(f"{OPTION} {text}: {tree.joints[joint].name} slides: a balancer is one of a joint that turns")
        if joint in found:
            raise ExperimentError(f"{OPTION} {text}: joint {where} has a balancer already: give one")
        found[joint] = _balancer(text, joint, words)
    return tuple(found.values())


def _balancer(text: str, joint: int, words: str) -> Balancer:
    settings = dict[str, float]()
    for word in words.split(","):
        name, mark, value = word.partition(":")
        if not mark or name not in GEOMETRY:
            known = f"{', '.join(GEOMETRY)}{did_you_mean(name, GEOMETRY)}"
            raise ExperimentError(f"{OPTION} {text}: {word!r} is no setting; write {EXAMPLE}; known: {known}")
        if name in settings:
            raise ExperimentError(f"{OPTION} {text}: {name} is given twice")
        try:
            settings[name] = float(value)
        except ValueError:
            raise ExperimentError(f"{OPTION} {text}: {name} = {value!r} must be a number") from None
    if missing := [name for name in ("a", "b") if name not in settings]:
        raise ExperimentError(f"{OPTION} {text}: {' and '.join(missing)} is missing: write {EXAMPLE}")
    try:
        return Balancer(joint, **settings)
    except SettingError as error:
        raise ExperimentError(f"{OPTION} {text}: {error}") from error
