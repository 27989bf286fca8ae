"""Laws of friction as options name them: of all joints, or of one."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, is_dataclass, replace
from itertools import chain
from typing import Any, final

from experiments.errors import ExperimentError
from identify import BLOCKS, AbstractBlock, AbstractJointLaw, OfJoints, UnknownNameError
from identify.plugins import did_you_mean

AUTO = "auto"
"""The laws are those that predict motion best that was not fitted."""

STANDARD = ("viscous", "coulomb")

GROUPS: Mapping[str, tuple[str, ...]] = {
    "standard": STANDARD,
    "asymmetric": (*STANDARD, "offset", "asymmetric-viscous"),
    "none": (),
}
"""Laws that go together, by one name."""

COMPARED = ("offset", "asymmetric-viscous", "load", "stribeck", "arctan", "temperature")
"""What `auto` compares, beside viscous and Coulomb friction; temperature where the log has it."""


@final
@dataclass(frozen=True)
class FrictionLaws:
    """The laws of each joint.

    Parameters
    ----------
    names : tuple of tuple of str
        Names of `BLOCKS`, joint by joint; a number after a colon is a law's first setting.
    auto : bool
        Whether what suits the logs is to be added.
    """

    names: tuple[tuple[str, ...], ...]
    auto: bool = False

    @classmethod
    def of(cls, texts: Sequence[str], joints: Sequence[str]) -> "FrictionLaws":
        """Return the laws that texts name, such as standard+load, or 2=standard+stribeck for joint 2 alone.

        Raises
        ------
        ExperimentError
            If a law or a joint is unknown.
        """
        n, auto = len(joints), False
        names: list[tuple[str, ...]] = [STANDARD] * n
        for text in texts:
            where, mark, laws = text.rpartition("=")
            if laws == AUTO and not mark:
                auto = True
                continue
            found = _laws(text, laws)
            names = [found if j in (_joint(text, where, joints) if mark else range(n)) else names[j] for j in range(n)]
        return cls(tuple(names), auto)

    @property
    def standard(self) -> bool:
        """Whether all joints have viscous and Coulomb friction, and may have more."""
        return all(set(STANDARD) <= set(own) for own in self.names)

    def with_more(self, more: Sequence[Sequence[str]]) -> "FrictionLaws":
        """Return these laws and more, joint by joint, all chosen."""
        pairs = zip(self.names, more, strict=True)
        return FrictionLaws(tuple((*own, *(name for name in others if name not in own)) for own, others in pairs))

    @property
    def texts(self) -> tuple[str, ...]:
        """The laws as options name them."""
        return tuple(f"{j + 1}={'+'.join(own) or 'none'}" for j, own in enumerate(self.names))

    def blocks(self, leave: Sequence[str] = ()) -> tuple[AbstractBlock, ...]:
        """Return the blocks of all joints, without those that are in another basis already."""
        every = [name for name in dict.fromkeys(chain(*self.names)) if name not in leave]
        return tuple(self._block(name) for name in every)

    def _block(self, name: str) -> AbstractBlock:
        joints = tuple(j for j, own in enumerate(self.names) if name in own)
        block = law_of(name)
        return block if len(joints) == len(self.names) else OfJoints(block, joints)


def _laws(text: str, laws: str) -> tuple[str, ...]:
    """Return the names of a sum of laws."""
    found = tuple(dict.fromkeys(chain(*(GROUPS.get(name, (name,)) for name in laws.split("+")))))
    for name in found:
        try:
            law_of(name)
        except UnknownNameError:
            known = [*GROUPS, AUTO, *(known for known in BLOCKS if isinstance(BLOCKS.create(known), AbstractJointLaw))]
            hint = did_you_mean(name.partition(":")[0], known)
            raise ExperimentError(f"--friction {text}: no law {name!r}{hint}; known: {', '.join(known)}") from None
    return found


def law_of(name: str) -> AbstractBlock:
    """Return the law of a name, its first setting the number after a colon.

    Raises
    ------
    ExperimentError
        If that is no law of a joint, or has no setting, or not that.
    """
    kind, mark, value = name.partition(":")
    block = BLOCKS.create(kind)
    if not isinstance(block, AbstractJointLaw):
        raise ExperimentError(f"--friction {name}: {kind} is no law of a joint's friction")
    if not mark:
        return block
    law: Any = getattr(block, "law", block)  # with a number an unknown shape is known
    settings = [f.name for f in fields(law)] if is_dataclass(law) else []
    try:
        found: AbstractBlock = replace(law, **{settings[0]: float(value)})
        return found
    except (IndexError, ValueError, TypeError) as error:
        raise ExperimentError(f"--friction {name}: {value!r} is no setting of {kind}, which takes a number: {error}") from error


def _joint(text: str, where: str, joints: Sequence[str]) -> set[int]:
    """Return the number of a joint by its number, from 1, or its name."""
    if where in joints:
        return {joints.index(where)}
    if where.isdigit() and 1 <= int(where) <= len(joints):
        return {int(where) - 1}
    raise ExperimentError(f"--friction {text}: there is no joint {where!r}; there are 1 to {len(joints)}: {', '.join(joints)}")
