"""Base parameters: the combinations of standard parameters that a motion can identify."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cache, cached_property
from typing import Self

import numpy as np

from idbench.identify.arrays import HELD, Array
from idbench.identify.basis.basis import Basis
from idbench.identify.basis.block import FRICTION, Parameter
from idbench.identify.basis.tree_links import tree_basis
from idbench.identify.data.kinematics import GROUND, Joint, KinematicTree
from idbench.identify.signals.signals import State

STATES = 56
"""Random states for each joint: four for each of its fourteen standard parameters, with a rotor and three laws of friction."""

ENOUGH = 4  # Joints beyond which more of them need no more states
SEED = 0  # Of the random states: any others give the same grouping, up to rounding

DEPENDENT = 1e-3
"""A column counts as a combination of those before it when its residual is below this share of a long column of its unit.

Descriptions round angles: of the arms of example-robot-data, columns that are dependent in the robot leave up to 3e-6 where
angles have four digits after the point (1.5708), up to 6e-4 with two (1.57); none that is independent leaves less than 0.09."""

GROUPED = 1e-5
"""Coefficients below this share of the largest of their grouping come from rounded angles: nothing is grouped by them."""

ROUNDING = 1e-13  # Sums below this share of their terms are zero but for rounding

SPEED, ACCELERATION = 5.0, 25.0
"""Largest rates of the random states [rad/s, rad/s^2]: as heavy as gravity, so that no kind of column drowns."""


@dataclass(frozen=True, eq=False)
class BaseParameters:
    """The grouping of a basis: X_base = K X_standard, from the columns of the explicit model at random states.

    A parameter whose column depends on those before it is grouped with them; one without effect is dropped. The first
    parameters in the order of the basis are kept (W. Khalil and E. Dombre, "Modeling, Identification and Control of Robots",
    2002, chapter 9; numerically M. Gautier, "Numerical calculation of the base inertial parameters of robots", J. Robotic
    Systems 8 (1991) 485-506).
    """

    standard: Basis
    """Links, armatures, frictions."""
    kept: tuple[int, ...]
    """Numbers of the parameters that stay, from 0."""
    K: Array
    """What each base parameter is made of, shape (b, p)."""
    parameters: tuple[Parameter, ...]
    """The base parameters."""

    @classmethod
    def of(cls, tree: KinematicTree, standard: Basis, written: Mapping[Parameter, Parameter] | None = None) -> Self:
        """Return the grouping of a robot's standard parameters; some are `written` with other letters, and to another scale.

        What resists motion is never grouped with what has inertia, weight or springs: its torques turn with the velocity.

        Examples
        --------
        >>> from idbench.identify import BaseParameters, tree_basis
        >>> from idbench.sim import kinematic_tree, load_robot
        >>> tree = kinematic_tree(load_robot("scara"))
        >>> BaseParameters.of(tree, tree_basis(tree)).groupings["ZZR1"]
        'ZZ1 + Ia1 + 0.25 M2'
        """
        W = np.moveaxis(columns_at(standard, random_states(tree, _count(tree))), 1, -1).reshape(-1, len(standard.names))
        large = _large(tree, standard, np.linalg.norm(W, axis=0))
        resists = np.array([parameter.kind in FRICTION for parameter in standard.parameters])
        # Random effects are not parameters to be told apart: slow random states hardly show those of slow motion.
        random = np.array([parameter.is_random_effect for parameter in standard.parameters])
        K, kept = np.diag(random.astype(np.float64)), [int(k) for k in np.flatnonzero(random)]
        for group in (~resists, resists & ~random):
            own = np.flatnonzero(group)
            first, part = _grouped(W[:, own] / large[own])
            stay = own[first]
            K[np.ix_(stay, own)] = part * large[own] / large[stay][:, None]
            kept.extend(int(k) for k in stay)
        kept.sort()
        K = K[kept]
        K[np.abs(K) < GROUPED * np.abs(K).max(axis=1, keepdims=True)] = 0.0
        several = np.count_nonzero(K, axis=1) > 1
        parameters = [(written or {}).get(p, p) for p in (standard.parameters[k] for k in kept)]
        K *= np.array([parameter.scale for parameter in parameters])[:, None]
        named = (replace(parameter, grouped=bool(more)) for parameter, more in zip(parameters, several, strict=True))
        return cls(standard, tuple(kept), K, tuple(named))

    @cached_property
    def basis(self) -> Basis:
        """The basis of the base parameters, whose columns are those of the parameters that stay."""
        return self.standard.of(self.parameters)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the base parameters: ZZ1 becomes ZZR1 where others are grouped with it."""
        return self.basis.names

    @property
    def without_effect(self) -> tuple[str, ...]:
        """Standard parameters that no motion excites."""
        return tuple(name for name, used in zip(self.standard.names, np.any(self.K, axis=0), strict=True) if not used)

    @cached_property
    def groupings(self) -> dict[str, str]:
        """What each base parameter is made of, by its name."""
        return {name: self.grouping(i) for i, name in enumerate(self.names)}

    def grouping(self, i: int) -> str:
        """Grouping of base parameter `i`, such as ZZ1 + Ia1 + 0.25 M2."""
        places = [self.kept[i], *(int(k) for k in np.flatnonzero(self.K[i]) if k != self.kept[i])]
        text = ""
        for k in places:
            c = self.K[i, k]
            size = "" if np.isclose(abs(c), 1, rtol=1e-6) else f"{abs(c):.6g} "
            text += f" {'-' if c < 0 else '+'} {size}{self.standard.names[k]}"
        return text.removeprefix(" + ")

    def base(self, standard: Array) -> Array:
        """Return the base values of standard values, shape (..., p); sums that are rounding alone are zero."""
        values = np.asarray(standard, dtype=np.float64)
        total, size = values @ self.K.T, np.abs(values) @ np.abs(self.K.T)
        return np.where(np.abs(total) > ROUNDING * size, total, 0.0)

    def values(self, standard: Mapping[str, float]) -> dict[str, float]:
        """Return the values of the base parameters by name, from those of standard parameters; one that is missing is zero."""
        known = np.array([standard.get(name, 0.0) for name in self.standard.names])
        return dict(zip(self.names, map(float, self.base(known)), strict=True))


def columns_at(basis: Basis, states: Array) -> Array:
    """Return the columns of the explicit model at q, qd, qdd, shape (3, joint, state), as (joint, p, state)."""
    q, qd, qdd = states
    W = np.zeros((basis.n, len(basis.names), q.shape[-1]))
    rng = np.random.default_rng(SEED)
    logged = {"temperature": rng.uniform(0, 60, q.shape), "payload": rng.integers(0, 2, (1, q.shape[-1])).astype(np.float64)}
    for (row, place), signal in basis.explicit(State(q, qd, lambda _: qdd, logged)).items():
        if place != HELD:
            W[row, place] = signal
    return W


def random_states(tree: KinematicTree, count: int) -> Array:
    """Return random positions inside the joints' ranges, or a turn, velocities and accelerations, shape (3, joint, count)."""
    rng = np.random.default_rng(SEED)
    low, high = np.array([joint.range for joint in tree.joints]).T
    zero = np.array([joint.zero for joint in tree.joints])
    low, high = np.where(np.isfinite(low), low, zero - np.pi), np.where(np.isfinite(high), high, zero + np.pi)
    ends = np.array([[low, high], [-SPEED * np.ones(tree.n), SPEED * np.ones(tree.n)], [-ACCELERATION * np.ones(tree.n)] * 2])
    ends[2, 1] = ACCELERATION
    return ends[:, 0, :, None] + rng.random((3, tree.n, count)) * (ends[:, 1] - ends[:, 0])[..., None]


def _grouped(W: Array) -> tuple[list[int], Array]:
    """Independent columns, and the matrix that makes all columns of them."""
    R: Array = np.linalg.qr(W, mode="r")  # type: ignore[assignment]  # mode "r" gives R alone
    kept = _independent(R)
    K: Array = np.asarray(np.linalg.lstsq(R[:, kept], R, rcond=None)[0], dtype=np.float64)
    K[:, np.linalg.norm(R, axis=0) <= DEPENDENT] = 0.0
    K[:, kept] = np.eye(len(kept))
    return kept, K


def _independent(R: Array) -> list[int]:
    """Return the columns that depend on none before them: their part off those that stay is no rounding of the file."""
    kept: list[int] = []
    Q = np.zeros((len(R), 0))
    for k in range(R.shape[1]):
        rest = R[:, k] - Q @ (Q.T @ R[:, k])
        rest -= Q @ (Q.T @ rest)
        if (size := np.linalg.norm(rest)) > DEPENDENT:
            kept.append(k)
            Q = np.column_stack([Q, rest / size])
    return kept


def _count(tree: KinematicTree) -> int:
    """Number of random states that group a robot's parameters; every state has a row for each joint."""
    return STATES * min(tree.n, ENOUGH)


def _large(tree: KinematicTree, standard: Basis, length: Array) -> Array:
    """Largest norm of a column of each parameter: the longest of its unit, that of a first moment against gravity."""
    units, kinds = np.array(standard.units), np.array([parameter.kind for parameter in standard.parameters])
    large = np.array([length[units == unit].max() for unit in units])
    weight = np.linalg.norm(tree.gravity) * np.sqrt(_count(tree))
    moments = kinds == "first moment"
    large[moments] = np.maximum(large[moments], weight)
    return np.maximum(large, ROUNDING * length.max() / DEPENDENT)


JOINTS = 2  # of the paper's SCARA


@cache
def scara() -> Basis:
    """Return the paper's SCARA: X = ZZR1 Fv1 Fs1 ZZ2 LMX2 LMY2 Fv2 Fs2 (section 7.1), whatever the length L of link 1.

    ZZR1 = ZZ1 + Ia1 + L^2 M2 (both about joint 1), ZZ2 about joint 2, LMX2 = L MX2 and LMY2 = L MY2. The axes are parallel to
    gravity, so no parameter of it appears. The energy of ZZ2 is 1/2 (qd1 + qd2)^2; the paper prints 1/2 (qd1^2 + qd2^2), which
    neither Eq. 10 nor its own explicit columns agree with.

    Examples
    --------
    >>> from idbench.identify import Offset, scara
    >>> (scara() + Offset()).names[-2:]
    ('off1', 'off2')
    """
    x, _, z = np.eye(3)
    joints = [Joint(f"joint{j + 1}", "hinge", j + GROUND, j * x, np.eye(3), z, 0 * x, armature=False) for j in range(JOINTS)]
    tree = KinematicTree("scara", tuple(joints), -9.81 * z)
    return BaseParameters.of(tree, tree_basis(tree), in_letters_of_the_paper(tree)).basis


def in_letters_of_the_paper(tree: KinematicTree) -> dict[Parameter, Parameter]:
    """The paper's letters of the first moments of link 2 of a SCARA; nothing of another tree."""
    if tree.n != JOINTS:
        return {}
    length = float(np.linalg.norm(tree.joints[1].position))
    plain = [Parameter(letters, 1, "first moment", "kg m") for letters in ("MX", "MY")]
    return {p: replace(p, unit="kg m^2", scale=length, label=f"L{p.symbol}") for p in plain}
