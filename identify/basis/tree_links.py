"""The links of any tree of hinges and slides."""

from collections.abc import Iterator, Mapping, Set
from dataclasses import dataclass, replace
from functools import cache, lru_cache, partial
from typing import Any, NamedTuple, Self

import numpy as np

from idbench.identify.basis.basis import Basis
from idbench.identify.basis.block import (
    AbstractBlock,
    AbstractColumns,
    AbstractConservativeBlock,
    BlockColumns,
    Kind,
    Parameter,
)
from idbench.identify.basis.friction.laws import CoulombFriction, ViscousFriction
from idbench.identify.basis.friction.load import TiedFriction
from idbench.identify.basis.joint_law import AbstractFriction, Armature
from idbench.identify.basis.of_joints import Coupled, OfJoints
from idbench.identify.basis.replay import Program, SignalOfSymbols, motion_of_symbols
from idbench.identify.basis.springs import Spring
from idbench.identify.basis.symbols import SymbolArray
from idbench.identify.basis.tape import Tape
from idbench.identify.basis.twists import (
    ZERO,
    Matrix,
    Term,
    Twist,
    Twists,
    Vector,
    add,
    cross,
    dot,
    is_zero,
    minus,
    plus,
    scaled,
    times,
)
from idbench.identify.data.kinematics import INERTIAL, KinematicTree
from idbench.identify.errors import SettingError
from idbench.identify.signals.signals import State

MX, M = INERTIAL.index("MX"), INERTIAL.index("M")

KINDS: dict[str, tuple[Kind, str]] = {
    **dict.fromkeys(INERTIAL[:MX], ("inertia", "kg m^2")),
    **dict.fromkeys(INERTIAL[MX:M], ("first moment", "kg m")),
    "M": ("mass", "kg"),
}
"""What the inertial parameters measure, and their units."""


class Wrench(NamedTuple):
    """Force M a + A MS and moment J (XX ... ZZ) + MS x a of a link with mass M and first moments MS."""

    a: Vector
    A: Matrix
    J: tuple[Vector, ...]

    @classmethod
    def inertial(cls, V: Twist, dV: Twist, up: Vector) -> Self:
        """Return force and moment that move a link, with its weight: a = dv + w x v - g, Newton and Euler."""
        v, w = V
        squares = times(w.x, w.x), times(w.y, w.y), times(w.z, w.z)
        xy, xz, yz = times(w.x, w.y), times(w.x, w.z), times(w.y, w.z)
        d = dV.w
        A = (
            Vector(times(-1.0, plus(squares[1], squares[2])), minus(xy, d.z), plus(xz, d.y)),
            Vector(plus(xy, d.z), times(-1.0, plus(squares[0], squares[2])), minus(yz, d.x)),
            Vector(minus(xz, d.y), plus(yz, d.x), times(-1.0, plus(squares[0], squares[1]))),
        )
        J = (
            Vector(d.x, xz, times(-1.0, xy)),
            Vector(minus(d.y, xz), plus(d.x, yz), minus(squares[0], squares[1])),
            Vector(plus(d.z, xy), minus(squares[2], squares[0]), minus(d.x, yz)),
            Vector(times(-1.0, yz), d.y, xy),
            Vector(minus(squares[1], squares[2]), minus(d.z, xy), plus(d.y, xz)),
            Vector(yz, times(-1.0, xz), d.z),
        )
        return cls(add(dV.v, cross(w, v), up), A, J)

    @classmethod
    def momentum(cls, V: Twist) -> Self:
        """Return momentum and angular momentum: a = v."""
        w = V.w
        minus_w = scaled(-1.0, w)
        A = Vector(0.0, minus_w.z, w.y), Vector(w.z, 0.0, minus_w.x), Vector(minus_w.y, w.x, 0.0)
        J = (
            Vector(w.x, 0.0, 0.0),
            Vector(w.y, w.x, 0.0),
            Vector(w.z, 0.0, w.x),
            Vector(0.0, w.y, 0.0),
            Vector(0.0, w.z, w.y),
            Vector(0.0, 0.0, w.z),
        )
        return cls(V.v, A, J)

    @classmethod
    def weight(cls, up: Vector) -> Self:
        """Acceleration that holds a link against gravity: a = -g."""
        return cls(up, (ZERO, ZERO, ZERO), (ZERO,) * 6)

    def along(self, twist: Twist, parameter: int) -> Term:
        """Power of a parameter's force and moment along a unit motion, by its number in INERTIAL."""
        if parameter < MX:
            return dot(twist.w, self.J[parameter])
        if parameter == M:
            return dot(twist.v, self.a)
        x, y, z = ((0, 1, 2), (1, 2, 0), (2, 0, 1))[parameter - MX]
        force = dot(Vector(*(row[x] for row in self.A)), twist.v)
        return plus(force, minus(times(self.a[y], twist.w[z]), times(self.a[z], twist.w[y])))


def energy(V: Twist, up: Vector, height: Term) -> tuple[Term, ...]:
    """Kinetic plus potential energy per parameter."""
    v, w = V
    half = scaled(0.5, w)
    squares = times(half.x, w.x), times(w.x, w.y), times(w.x, w.z), times(half.y, w.y), times(w.y, w.z), times(half.z, w.z)
    return (*squares, *add(cross(v, w), up), plus(times(0.5, dot(v, v)), height))


@dataclass(frozen=True)
class TreeLinks(AbstractConservativeBlock, AbstractColumns):
    """Rigid links of a tree, ten parameters each: XX1 XY1 XZ1 YY1 YZ1 ZZ1 MX1 MY1 MZ1 M1, XX2, ...

    The inertia matrix and the first moments are about the origin of the link's frame, in its axes. By Newton and Euler, and by
    Lagrange for the columns of the implicit and power models: with V_j the twist of link j, T_j = V_j' P_j / 2 and

        p_i = sum_j (dV_j/dqd_i)' P_j        remainder_i = sum_j -(dV_j/dq_i)' P_j + gravity
    """

    tree: KinematicTree
    """The robot."""
    only: frozenset[Parameter] | None = None
    """Parameters whose columns are computed; all by default."""

    def parameters(self, n: int) -> tuple[Parameter, ...]:
        """Return ten parameters for each link that has mass; raise SettingError unless the tree has `n` joints."""
        if n != self.tree.n:
            raise SettingError(f"robot {self.tree.name!r} has {self.tree.n} joints, not {n}")
        return tuple(parameter for j in _massive(self.tree) for parameter in parameters_of_link(j))

    def narrowed(self, parameters: Set[Parameter]) -> Self:
        """Return this block without the work for other parameters."""
        return replace(self, only=frozenset(parameters))

    def columns(self, function: str, state: State) -> BlockColumns:
        """Return the columns that are asked for and not zero at all times."""
        if isinstance(state.q, np.ndarray):
            return _replay(self.tree, self.only, function).of(state)
        signals: tuple[Any, ...] = state.q, state.qd, state.qdd
        at_one_instant = motion_of_symbols(*(SignalOfSymbols(x.values[:, 0].item) for x in signals))
        columns: Any = _asked(_formulas(self.tree, function, at_one_instant), self.only)
        return {key: SymbolArray([x]) for key, x in columns.items()}


def _massive(tree: KinematicTree) -> tuple[int, ...]:
    return tuple(j for j, joint in enumerate(tree.joints) if joint.massive)


def _asked(
    columns: Mapping[tuple[int, Parameter], Term], only: frozenset[Parameter] | None
) -> dict[tuple[int, Parameter], Any]:
    return {key: x for key, x in columns.items() if (only is None or key[1] in only) and not is_zero(x)}


@lru_cache(maxsize=64)
def _replay(tree: KinematicTree, only: frozenset[Parameter] | None, function: str) -> Program[tuple[int, Parameter]]:
    tape, columns = _recorded(tree, function)
    return Program(tape, _asked(columns, only))


@lru_cache(maxsize=32)
def _recorded(tree: KinematicTree, function: str) -> tuple[Tape, Mapping[tuple[int, Parameter], Term]]:
    tape = Tape()
    motion = motion_of_symbols(*(SignalOfSymbols(partial(tape.input, name)) for name in ("q", "qd", "qdd")))
    return tape, _formulas(tree, function, motion)


def _formulas(tree: KinematicTree, function: str, state: State) -> dict[tuple[int, Parameter], Term]:
    """Return the columns of (row, parameter): what each parameter of a link adds along the motion that joint i gives it."""
    at, massive = Twists(tree, state), _massive(tree)
    if function == "energy":
        stored = {j: energy(at.velocity[j], at.up[j], at.height[j]) for j in massive}
        return {(0, p): x for j in massive for p, x in zip(parameters_of_link(j), stored[j], strict=True)}
    if function == "explicit":
        wrench = {j: Wrench.inertial(at.velocity[j], at.acceleration[j], at.up[j]) for j in massive}
    else:
        wrench = {j: Wrench.momentum(at.velocity[j]) for j in massive}
    weight = {j: Wrench.weight(at.up[j]) for j in massive} if function == "remainder" else {}

    def column(i: int, j: int, x: int) -> Term:
        if function == "remainder":
            return minus(weight[j].along(at.unit[j][i], x), wrench[j].along(at.slope[j][i], x))
        return wrench[j].along(at.unit[j][i], x)

    return {(i, p): column(i, j, x) for j in massive for i in tree.ancestors(j) for x, p in enumerate(parameters_of_link(j))}


@cache
def parameters_of_link(j: int) -> tuple[Parameter, ...]:
    """Return the ten parameters of a link."""
    return tuple(Parameter(x, j, *what) for x, what in KINDS.items())


def tree_basis(tree: KinematicTree, laws: tuple[AbstractBlock, ...] = (ViscousFriction(), CoulombFriction())) -> Basis:
    """Return links, armatures and springs where the tree has them, and laws of friction: the standard parameters, by joint.

    Drives that turn with several joints have an armature and the laws of friction, too.

    Friction laws are added as to any basis, as in ``tree_basis(tree) + Offset()``. Standard parameters cannot all be
    identified: `BaseParameters` groups them.

    Examples
    --------
    >>> from idbench.identify import BaseParameters, tree_basis
    >>> from idbench.sim import kinematic_tree, load_robot
    >>> tree = kinematic_tree(load_robot("scara"))
    >>> basis = tree_basis(tree)
    >>> len(basis.names), BaseParameters.of(tree, basis).names
    (25, ('ZZR1', 'Fv1', 'Fs1', 'ZZ2', 'MX2', 'MY2', 'Fv2', 'Fs2'))
    """
    driven = tuple(j for j, joint in enumerate(tree.joints) if joint.armature)
    sprung = {j: joint.spring for j, joint in enumerate(tree.joints) if joint.spring is not None}
    rest = tuple(sprung.get(j, 0.0) for j in range(tree.n))
    springs = (OfJoints(Spring(rest), tuple(sprung)),) if sprung else ()
    blocks = TreeLinks(tree), OfJoints(Armature(), driven), *springs, *laws, *_of_couplings(tree, laws)
    parameters = [parameter for block in blocks for parameter in block.parameters(tree.n)]
    kept = tuple(sorted(parameters, key=lambda p: -1 if p.joint is None else p.joint))
    return Basis(tree.n, blocks, kept, tuple(j for j, joint in enumerate(tree.joints) if joint.kind == "slide"))


def _of_couplings(tree: KinematicTree, laws: tuple[AbstractBlock, ...]) -> Iterator[AbstractBlock]:
    """Yield what drives that turn with several joints have: rotor, spring, and laws of friction that all these joints have.

    Those are laws of motion alone: a load is a joint's.
    """
    for coupling in tree.couplings:
        if coupling.armature:
            yield Coupled(Armature(), coupling)
        if coupling.spring is not None:
            yield Coupled(Spring((coupling.spring,)), coupling)
        turned = set(np.flatnonzero(coupling.weights).tolist())
        inner = [law.block if isinstance(law, OfJoints) and turned <= set(law.joints) else law for law in laws]
        own = [law for law in inner if isinstance(law, AbstractFriction)]
        yield from (Coupled(law, coupling) for law in own)
        if any(isinstance(law, CoulombFriction) for law in own) and len(turned) > 1:
            yield TiedFriction(coupling)
