"""The robot that is identified: its basis, its joints, and what is true of it where it is simulated."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any, Self

import numpy as np

from idbench.experiments.errors import ExperimentError
from idbench.experiments.identification.friction_laws import AUTO, SMOOTH, FrictionLaws, balancers, joint_laws, law_of
from idbench.experiments.identification.known import Known, RoughlyKnown
from idbench.experiments.requests.shared import Parameters
from idbench.identify import Array, BaseParameters, Basis, IdentificationError, KinematicTree, SettingError, tree_basis
from idbench.identify.basis.block import named
from idbench.identify.parameters.base_parameters import in_letters_of_the_paper
from idbench.identify.rows.factors import Prior
from idbench.identify.tables import html_table, text_table
from idbench.sim.errors import BenchError
from idbench.sim.frictions import AbstractFrictionLaw
from idbench.sim.robot.mounting import PLAIN, Mounting, with_values
from idbench.sim.robot.robot import FILES, Robot
from idbench.sim.robot.tree import kinematic_tree, standard_parameters
from idbench.sim.robot.varied import model_fields

SCARA = "scara"  # The robot of the paper, which is taken where none is named
ASSUMED = f"no --robot was given, the shipped {SCARA} is assumed"


@dataclass(frozen=True, eq=False)
class RobotModel:
    """A robot by its name or file, and which of its parameters are asked for."""

    name: str = SCARA
    """Name of a robot that ships, or path of an MJCF or URDF file."""
    asked: Parameters = Parameters()  # noqa: RUF009  # frozen
    """Which of its parameters are asked for."""
    mounting: Mounting = PLAIN
    """How it is mounted, and which of its joints move."""
    assumed: bool = False
    """Whether nobody says of which robot the log is."""

    def __repr__(self) -> str:
        return text_table(*self._table())

    def _repr_html_(self) -> str:
        return html_table(*self._table())

    def _table(self) -> tuple[str, list[str], list[list[str]]]:
        made = self.grouping.groupings
        rows = [[name, unit, made.get(name, "")] for name, unit in zip(self.basis.names, self.basis.units, strict=True)]
        joints = ", ".join(self.robot.joints)
        return f"{self.name}: joints {joints}; {len(rows)} identifiable parameters", ["", "unit", "made of"], rows

    @cached_property
    def robot(self) -> Robot:
        """The robot as its file describes it, mounted as it is."""
        if self.mounting.plain and not self.asked.hold:
            return Robot.load(self.name)
        return Robot.load(self.name, self.mounting.edit, with_values(self.known.values))

    @cached_property
    def known(self) -> Known:
        """Parameters that are known; ExperimentError if what is held makes no sense."""
        return Known.of(self.asked.hold)

    @cached_property
    def roughly_known(self) -> RoughlyKnown:
        """What is roughly known; ExperimentError if that makes no sense."""
        return RoughlyKnown.of(self.asked.prior)

    @property
    def stated(self) -> dict[str, Any]:
        """What a summary.json says of what is known: held, tied, and roughly known."""
        asked = self.asked
        found = {"held": self.held if asked.hold else {}, "tied": list(asked.tie), "prior": list(asked.prior)}
        return {name: of for name, of in found.items() if of}

    @property
    def share_sought(self) -> bool:
        """Whether the log decides how near links are to those of the file."""
        return bool(self.asked.prior) and self.roughly_known.links and self.roughly_known.share is None

    def prior(self, share: float | None = None) -> Prior | None:
        """Prior of the parameters, links to a `share` of the file's; None if there is none."""
        if not self.asked.prior:
            return None
        return self.roughly_known.prior(self.grouping, self.basis, self.filed, share)

    def check(self) -> Basis:
        """Return the basis; raise ExperimentError or IdentificationError if laws, priors or known parameters are of none."""
        self.prior()
        return self.basis

    @cached_property
    def given(self) -> dict[str, float]:
        """Standard parameters of the robot's file, by name."""
        return standard_parameters(self.robot)

    @cached_property
    def filed(self) -> Array:
        """Standard parameters as the robot's file has them, shape (standard parameter,); zero of what it does not have."""
        return np.array([self.given.get(name, 0.0) for name in self.grouping.standard.names])

    @cached_property
    def held(self) -> dict[str, float]:
        """Standard parameters that are held, by name."""
        return {parameter.name: float(np.asarray(value)) for parameter, value in self.grouping.standard.held.items()}

    @cached_property
    def tree(self) -> KinematicTree:
        """Its description."""
        tree = kinematic_tree(self.robot, [name for name, _ in self.mounting.couplings])
        if self.asked.armature == "file" or (self.asked.armature == "auto" and not self.rotors_assumed):
            return tree
        rotors = self.asked.armature != "none"
        joints = tuple(replace(joint, armature=rotors) for joint in tree.joints)
        return replace(tree, joints=joints, couplings=tuple(replace(c, armature=rotors) for c in tree.couplings))

    @cached_property
    def rotors_assumed(self) -> bool:
        """Whether all joints have rotors because the robot's file cannot say which do."""
        silent = Path(self.name).suffix.lower() in FILES and Path(self.name).suffix.lower() != ".xml"
        return self.asked.armature == "auto" and silent and not self.robot.model.dof_armature.any()

    @cached_property
    def grouping(self) -> BaseParameters:
        """How its standard parameters are grouped; those of the SCARA in the letters of the paper."""
        standard = self._tied(self._with_laws(tree_basis(self.tree, self.laws.blocks())))
        written = in_letters_of_the_paper(self.tree) if self.name == SCARA else None
        if not self.asked.hold:
            return BaseParameters.of(self.tree, standard, written)
        grouping = BaseParameters.of(self.tree, self.known.holding(standard, self.given), written)
        self.known.require(standard, grouping.basis)
        return grouping

    @property
    def plain(self) -> Self:
        """The robot with standard friction alone, linear in its parameters whatever the laws of friction are."""
        return replace(self, asked=replace(self.asked, friction=Parameters().friction, add=(), without=()))

    def without(self, names: Sequence[str]) -> Self:
        """Return the robot with more parameters left out, as if they were zero."""
        return replace(self, asked=replace(self.asked, without=(*self.asked.without, *names)))

    def require_laws(self) -> None:
        """Raise ExperimentError if its laws of friction are those that suit a log, where there is none."""
        if word := SMOOTH if self.laws.smooth else AUTO if self.laws.auto else "":
            raise ExperimentError(f"--friction {word} looks at a log, and there is none here: name the laws")

    def require_linear(self) -> None:
        """Raise ExperimentError if its laws of friction hold about an estimate alone."""
        self.require_laws()
        if self.basis.is_nonlinear:
            raise ExperimentError(
                "--friction: motions are designed for laws that are linear; give their shapes, as in stribeck:0.1, and leave "
                "load out"
            )

    @cached_property
    def laws(self) -> FrictionLaws:
        """The laws of friction of its joints."""
        return FrictionLaws.of(self.asked.friction, self.robot.joints)

    def units(self, j: int) -> tuple[str, str]:
        """Return the units of a joint's torque and position."""
        return ("N", "m") if self.tree.joints[j].kind == "slide" else ("N m", "rad")

    @cached_property
    def basis(self) -> Basis:
        """What is identified."""
        whole = self.grouping.basis
        if self.asked.hold:  # base parameters may be held, too
            whole = Known((), self.known.values).holding(whole, self.grouping.values(self.given))
        if missing := [name for name in self.asked.without if name not in whole.names]:
            laws = "" if self.laws.standard else f" with --friction {' '.join(self.asked.friction)}"
            raise ExperimentError(
                f"--without: there is no parameter {', '.join(missing)}{laws}; there are {', '.join(whole.names)}"
            )
        return whole.without(*self.asked.without) if self.asked.without else whole

    def truth(self, robot: Robot, friction: AbstractFrictionLaw | None = None) -> dict[str, float]:
        """Return the true value of every parameter of the basis for `robot`, this one as it is simulated, with its friction.

        What the simulated robot does not have, such as an offset, is zero.
        """
        standard = standard_parameters(robot) | (friction.truth(robot) if friction else {})
        known = self.grouping.values(standard)
        return {name: known.get(name, 0.0) for name in self.basis.names}

    def fields(self, X: Array, *, exact: bool = True) -> dict[str, Array]:
        """Return MuJoCo's fields of robots with parameters X, shape (nsim, p): those nearest to the file's standard parameters.

        Parameters that these robots do not have are an error if they must be exact, and left out otherwise.

        Raises
        ------
        IdentificationError
            If a parameter is of a law of friction that the simulated robot does not have.
        """
        grouping = self.grouping
        base = np.zeros((len(X), len(grouping.names)))
        base[:, [grouping.basis.places[parameter] for parameter in self.basis.parameters]] = X
        if exact and (unknown := [name for name in grouping.standard.names if name not in self.given]):
            raise IdentificationError(
                f"{', '.join(unknown)} cannot be simulated: robots of MuJoCo have viscous and Coulomb friction alone; use IV, "
                "which does without them, an estimator that does not simulate, or leave these laws out"
            )
        # Robot by robot: a product of all of them at once would have other bits for other numbers of robots.
        standard = self.filed + np.matmul(self._back, (base - grouping.base(self.filed))[..., None])[..., 0]
        try:
            values: dict[str, Array] = dict(zip(grouping.standard.names, standard.T, strict=True))
            values |= {p.name: values[other.name] for p, other in grouping.standard.tied.items() if other.name in values}
            return model_fields(self.robot, {name: x for name, x in values.items() if name in self.given})
        except BenchError as error:
            raise IdentificationError(f"a robot with these parameters cannot be simulated: {error}") from error

    @cached_property
    def _back(self) -> Array:
        """Changes of the standard parameters, least as shares of themselves, with which each base parameter changes by one."""
        scale = np.where(self.filed == 0, 1.0, np.abs(self.filed))
        return scale[:, None] * np.linalg.pinv(self.grouping.K * scale)

    def _tied(self, basis: Basis) -> Basis:
        """Return a basis with the parameters tied that are said to be equal; ExperimentError if that makes no sense."""
        ties = dict[str, str]()
        for word in self.asked.tie:
            name, equals, other = word.partition("=")
            if not (name and equals and other) or name in ties:
                raise ExperimentError(f"--tie {word}: write NAME=NAME, each name on the left once, as in Ia1=Ia4")
            ties[name] = other
        try:
            return basis.with_ties(**ties) if ties else basis
        except SettingError as error:
            raise ExperimentError(f"--tie: {error}") from error

    def equal(self, values: Mapping[str, float]) -> dict[str, float]:
        """Return standard values with what is held, tied to others, or not asked for, beside those that are given."""
        tied = {p.name: values[other.name] for p, other in self.grouping.standard.tied.items() if other.name in values}
        return {**self._unasked(), **self.held, **values, **tied}

    def _unasked(self) -> dict[str, float]:
        """Zeros of what the identification leaves out and the robot's file may have: rotors, laws of friction."""
        found = {named("Ia", j): 0.0 for j in range(self.robot.n)} if self.asked.armature == "none" else {}
        for letters, law in (("Fv", "viscous"), ("Fs", "coulomb")):
            found |= {named(letters, j): 0.0 for j, own in enumerate(self.laws.names) if law not in own}
        return found

    def _with_laws(self, basis: Basis) -> Basis:
        for name in self.asked.add:
            if name not in (laws := joint_laws()):
                raise ExperimentError(f"--add {name}: that is no law of a joint's friction; known: {', '.join(laws)}")
            basis = basis + law_of(name, "--add")
        for balancer in balancers(self.asked.balancer, self.tree):
            basis = basis + balancer
        return basis


def absolute(robot: str) -> str:
    """Return the name of a robot, or the path of its file from the root: results are read from other folders too."""
    return str(Path(robot).absolute()) if Path(robot).suffix in FILES else robot
