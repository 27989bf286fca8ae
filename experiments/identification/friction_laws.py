"""Laws of friction as options name them: of all joints, or of one."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, is_dataclass, replace
from itertools import chain
from typing import Any

from idbench.experiments.errors import ExperimentError
from idbench.identify import BLOCKS, AbstractBlock, AbstractJointLaw, Array, KinematicTree, SettingError, UnknownNameError
from idbench.identify.basis import Balancer, OfJoints
from idbench.identify.plugins import did_you_mean

AUTO = "auto"  # The laws are those that predict motion best that was not fitted
SMOOTH = "smooth"  # The friction of every joint is a smooth function of its velocity, beside standard laws and load

STANDARD = ("viscous", "coulomb")

GROUPS: Mapping[str, tuple[str, ...]] = {
    "standard": STANDARD,
    "asymmetric": (*STANDARD, "offset", "asymmetric-viscous"),
    "none": (),
}
"""Laws that go together, by one name."""

NUMBERS = (float, Array | float)  # Types of settings that a number after a colon may be

BEYOND, LARGEST = 100.0, 1e6
"""How far beyond the range in which a shape is looked for it may be given, and the largest of other settings."""

COMPARED = ("offset", "asymmetric-viscous", "load", "stribeck", "arctan", "tanh", "temperature")
"""What `auto` compares, beside viscous and Coulomb friction; temperature where the log has it, and tanh, which differs from
Coulomb friction at rest alone, where no mask takes that out."""


@dataclass(frozen=True)
class FrictionLaws:
    """The laws of each joint."""

    names: tuple[tuple[str, ...], ...]
    """Names of `BLOCKS`, joint by joint; a number after a colon is a law's first setting."""
    auto: bool = False
    """Whether what suits the logs is to be added."""
    smooth: bool = False
    """Whether smooth functions, whose sizes the logs decide, are to be added."""

    @classmethod
    def of(cls, texts: Sequence[str], joints: Sequence[str]) -> "FrictionLaws":
        """Return the laws that texts name, such as standard+load, or 2=standard+stribeck for joint 2 alone.

        Raises
        ------
        ExperimentError
            If a law or a joint is unknown.
        """
        if SMOOTH in texts:
            if len(texts) > 1:
                raise ExperimentError(
                    f"--friction {' '.join(texts)}: smooth stands alone: it has standard laws and load of all joints"
                )
            return cls((STANDARD,) * len(joints), smooth=True)
        given = dict[int | str | None, tuple[str, tuple[str, ...]]]()  # by joint; None: of all
        for text in texts:
            where, mark, laws = text.rpartition("=")
            place = joint_of(f"--friction {text}", where, joints) if mark else AUTO if laws == AUTO else None
            if place in given:
                raise ExperimentError(_twice(given[place][0], text, mark))
            given[place] = text, () if place == AUTO else _laws(text, laws)
        every = given.get(None, ("", STANDARD))[1]
        return cls(tuple(given.get(j, ("", every))[1] for j in range(len(joints))), AUTO in given)

    @property
    def standard(self) -> bool:
        """Whether all joints have viscous and Coulomb friction, and may have more."""
        return all(set(STANDARD) <= set(own) for own in self.names)

    def chosen(self, more: Sequence[Sequence[str]], idle: Sequence[Sequence[str]]) -> "FrictionLaws":
        """Return these laws and more, joint by joint, without those of some letters."""
        found = list[tuple[str, ...]]()
        for own, others, out in zip(self.names, more, idle, strict=True):
            kept = [name for name in own if getattr(law_of(name), "symbol", "") not in out]
            found.append((*kept, *(name for name in others if name not in kept)))
        return FrictionLaws(tuple(found))

    def texts(self, joints: Sequence[str]) -> tuple[str, ...]:
        """Return the laws as options name them."""
        return tuple(f"{said(j, joints)}={'+'.join(own) or 'none'}" for j, own in enumerate(self.names))

    def blocks(self) -> tuple[AbstractBlock, ...]:
        """Return the blocks of all joints."""
        return tuple(map(self._block, dict.fromkeys(chain(*self.names))))

    def _block(self, name: str) -> AbstractBlock:
        joints = tuple(j for j, own in enumerate(self.names) if name in own)
        block = law_of(name)
        return block if len(joints) == len(self.names) else OfJoints(block, joints)


def _twice(first: str, second: str, mark: str) -> str:
    """Message that two texts give the laws of the same joints, with the likely intention."""
    if first == second:
        return f"--friction {first} {second}: the same is given twice: leave one out"
    whose = "that joint" if mark else "all joints"
    both = f"{first}+{second.rpartition('=')[2]}"
    return (
        f"--friction {first} {second}: both give the laws of {whose}, and only one can hold: write {both} (with +, no blank) "
        "for the sum, or name a joint, as in 1=standard+load"
    )


def _laws(text: str, laws: str) -> tuple[str, ...]:
    """Return the names of a sum of laws; raise ExperimentError if one contradicts another or is given twice."""
    terms = laws.split("+")
    if AUTO in terms:
        raise ExperimentError(
            f"--friction {text}: auto is no term of a sum: write it apart, as in --friction {AUTO} standard+load"
        )
    if "none" in terms and len(terms) > 1:
        raise ExperimentError(f"--friction {text}: none is no friction at all: leave out none, or the others")
    split = ((term.partition(":")[0], term) for term in terms)
    # Laws that ask for a number are others with another.
    kinds = [term if x in BLOCKS and getattr(BLOCKS.create(x), "asks", None) else x for x, term in split]
    if again := next((kind for kind in kinds if kind and kinds.count(kind) > 1), ""):
        raise ExperimentError(f"--friction {text}: {again} is given twice in the sum: leave one out")
    found = tuple(dict.fromkeys(chain(*(GROUPS.get(name, (name,)) for name in terms))))
    for name in found:
        try:
            law_of(name)
        except UnknownNameError:
            known = [*GROUPS, AUTO, *joint_laws()]
            hint = did_you_mean(name.partition(":")[0], known)
            raise ExperimentError(f"--friction {text}: no law {name!r}{hint}; known: {', '.join(known)}") from None
    return found


def joint_laws() -> list[str]:
    """Names of the laws of a joint's friction."""
    return [name for name in BLOCKS if isinstance(BLOCKS.create(name), AbstractJointLaw)]


def law_of(name: str, option: str = "--friction") -> AbstractBlock:
    """Return the law of a name, its first setting the number after a colon.

    Raises
    ------
    ExperimentError
        If that is no law of a joint, or has no setting, or not that.
    """
    kind, mark, value = name.partition(":")
    block = BLOCKS.create(kind)
    if not isinstance(block, AbstractJointLaw):
        raise ExperimentError(f"{option} {name}: {kind} is no law of a joint's friction")
    if not mark:
        if block.asks:
            raise ExperimentError(f"{option} {name}: give {block.asks}")
        return block
    law: Any = getattr(block, "law", block)  # with a number an unknown shape is known
    settings = [f.name for f in fields(law) if f.type in NUMBERS] if is_dataclass(law) else []
    if not settings:
        raise ExperimentError(f"{option} {name}: {kind} has no setting: leave :{value} out")
    shapes = getattr(block, "shapes", ())
    if len(shapes) > 1:
        own = ", ".join(shape.letters for shape in shapes)
        raise ExperimentError(f"{option} {name}: {kind} is the law of unknown {own}: leave :{value} out, or name a law of one")
    low, high = (shapes[0].range[0] / BEYOND, shapes[0].range[1] * BEYOND) if shapes else (-LARGEST, LARGEST)
    try:
        number = float(value)
        if not low <= number <= high:
            raise ValueError(f"it must be from {low:g} to {high:g}")
        found: AbstractBlock = replace(law, **{settings[0]: number})
        return found
    except (ValueError, TypeError) as error:
        raise ExperimentError(f"{option} {name}: {value!r} is no {settings[0]} of {kind}: {error}") from error


def said(j: int, joints: Sequence[str]) -> str:
    """Name of a joint in an option: by its number, unless some joint is called like that."""
    return joints[j] if str(j + 1) in joints else str(j + 1)


def joint_of(option: str, where: str, joints: Sequence[str]) -> int:
    """Return the number of a joint, from 0, by its number, from 1, or its name; ExperimentError if there is none."""
    if where in joints:
        return joints.index(where)
    if where.isdecimal() and 1 <= int(where) <= len(joints):
        return int(where) - 1
    raise ExperimentError(f"{option}: there is no joint {where!r}; there are 1 to {len(joints)}: {', '.join(joints)}")


OPTION = "--balancer"
GEOMETRY = tuple(field.name for field in fields(Balancer) if field.name != "joint")  # What is stated of a balancer

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
