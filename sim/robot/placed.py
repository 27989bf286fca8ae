"""A robot as links that hang on each other, as files of other simulators describe it: a link's frame is at its joint's axis."""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np

from idbench.identify.basis.block import named
from idbench.identify.data.kinematics import INERTIAL, Joint, KinematicTree
from idbench.sim.robot.motors import Array
from idbench.sim.robot.robot import Robot

BASE = "base"  # Name of the link that stands


@dataclass(frozen=True)
class Body:
    """Mass, centre of mass, and inertia about it, in the axes of a link's frame."""

    mass: float
    """[kg]."""
    centre: Array
    """[m], shape (3,)."""
    inertia: Array
    """[kg m^2], shape (3, 3)."""

    @classmethod
    def of(cls, standard: Mapping[str, float], j: int, origin: Array | None = None) -> "Body | None":
        """Return the body of a link, its frame at an origin in that of the tree; None if it has none."""
        if named("M", j) not in standard:
            return None
        body = cls.with_values(standard[named(x, j)] for x in INERTIAL)
        return body if origin is None else replace(body, centre=body.centre - origin)

    @classmethod
    def with_values(cls, values: Iterable[float]) -> "Body":
        """Return the body of XX XY XZ YY YZ ZZ about the origin of a frame, first moments and mass."""
        xx, xy, xz, yy, yz, zz, *first, mass = values
        centre = np.array(first) / mass if mass > 0 else np.zeros(3)
        about = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        return cls(float(mass), centre, about - mass * (centre @ centre * np.eye(3) - np.outer(centre, centre)))


@dataclass(frozen=True)
class PlacedLink:
    """A link, and the joint that it hangs on."""

    name: str
    """Of the link."""
    parent: str
    """Of the link that carries it."""
    joint: Joint
    """Of the tree."""
    place: Array
    """Of its frame in that of the parent, where the joint is at 0 [m], shape (3,)."""
    angles: Array
    """Roll, pitch and yaw of it [rad], shape (3,)."""
    body: Body | None
    """What it weighs."""
    limits: dict[str, float]
    """lower, upper, effort, velocity, where they are finite."""
    drive: dict[str, float]
    """Ia, Fv, Fs, K of the joint, where they are known."""


def placed_links(robot: Robot, tree: KinematicTree, standard: Mapping[str, float]) -> Iterator[PlacedLink]:
    """Yield the links of a robot with standard parameters, parents first."""
    names = [f"link_{joint.name}" for joint in tree.joints]
    names = [f"{name}_" if name in {joint.name for joint in tree.joints} else name for name in names]  # SDF wants all to differ
    anchors = [np.zeros(3) if joint.kind == "slide" else joint.anchor for joint in tree.joints]
    for j, of in enumerate(tree.joints):
        slide, before = of.kind == "slide", anchors[of.parent] if of.parent >= 0 else np.zeros(3)
        # Positions count from 0 in these files: the frame is placed where the joint is 0.
        turned = of.rotation @ (np.eye(3) if slide else _turn(of.axis, -of.zero))
        place = of.position + of.rotation @ anchors[j] - before - (of.rotation @ of.axis * of.zero if slide else 0)
        most = {"effort": robot.torque_limits[j], "velocity": robot.most("velocity")[j]}
        limits = {"lower": of.range[0], "upper": of.range[1], **most}
        yield PlacedLink(
            names[j],
            names[of.parent] if of.parent >= 0 else BASE,
            of,
            place,
            _angles(turned),
            Body.of(standard, j, anchors[j]),
            {name: float(x) for name, x in limits.items() if np.isfinite(x)},
            {x: float(standard[named(x, j)]) for x in ("Ia", "Fv", "Fs", "K") if named(x, j) in standard},
        )


def _turn(axis: Array, angle: float) -> Array:
    x, y, z = axis
    K = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.asarray(np.eye(3) + np.sin(angle) * K + (1 - np.cos(angle)) * (K @ K))


def _angles(R: Array) -> Array:
    """Return roll, pitch and yaw of a rotation, Rz(yaw) Ry(pitch) Rx(roll)."""
    pitch = np.arctan2(-R[2, 0], np.hypot(R[0, 0], R[1, 0]))
    if np.hypot(R[0, 0], R[1, 0]) < 1e-9:  # roll and yaw turn about one axis
        return np.array([np.arctan2(-R[1, 2], R[1, 1]), pitch, 0.0])
    return np.array([np.arctan2(R[2, 1], R[2, 2]), pitch, np.arctan2(R[1, 0], R[0, 0])])


def numbers(values: Array) -> str:
    """Return numbers as such files have them."""
    return " ".join(repr(float(value)) for value in without_rounding(values, 1.0))


def without_rounding(values: Array, beside: float = 0.0) -> Array:
    """Return values with 0 for what rounding made of it: less than 1e-15 of the largest, or of what they are sums of."""
    size = np.abs(values)
    return np.where(size <= 1e-15 * max(float(np.max(size, initial=0.0)), beside), 0.0, values)
