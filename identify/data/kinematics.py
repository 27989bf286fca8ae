"""The kinematics of a robot: all that identification needs to know of its geometry."""

from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np

from idbench.identify.arrays import Array, frozen
from idbench.identify.errors import KinematicsError, SettingError

Kind = Literal["hinge", "slide"]

GROUND = -1  # Number of the parent of a joint that stands on the ground

INERTIAL = ("XX", "XY", "XZ", "YY", "YZ", "ZZ", "MX", "MY", "MZ", "M")
"""Letters of a link's ten parameters: inertia matrix about the origin of its frame, first moments, mass."""

ROUNDING = 1e-12  # Entries of rotations and axes below this are rounding, and zero


@dataclass(frozen=True, eq=False)
class Joint:
    """A joint, and the link that it moves.

    The frame of the link stands at `position` and `rotation` in the frame of its parent's link while the joint is at `zero`.

    Raises
    ------
    KinematicsError
        If a value is of the wrong shape or not finite, the rotation is none, or the axis has no length.
    """

    name: str
    """Of the joint."""
    kind: Kind
    """What it does."""
    parent: int
    """Number of the joint whose link carries it, from 0; `GROUND` if none does."""
    position: Array
    """Shape (3,) [m]."""
    rotation: Array
    """Turns vectors of the link into those of its parent, shape (3, 3)."""
    axis: Array
    """Direction in the frame of the link, of any length above 0, shape (3,)."""
    anchor: Array
    """A point of a hinge's axis in the frame of the link [m], shape (3,)."""
    zero: float = 0.0
    """Position [rad or m] at which the frames are placed like this."""
    range: tuple[float, float] = (-np.inf, np.inf)
    """Lowest and highest position [rad or m]; infinite without limits."""
    armature: bool = True
    """Whether its drive adds an inertia of its own."""
    massive: bool = True
    """Whether its link has mass; False for the links between several joints of one body."""
    spring: float | None = None
    """Position [rad or m] at which a spring on the joint makes no torque, if it has one."""

    def __post_init__(self) -> None:
        if self.kind not in get_args(Kind):
            raise KinematicsError(f"joint {self.name}: kind {self.kind!r} is none of {', '.join(get_args(Kind))}")
        for name, shape in (("position", (3,)), ("rotation", (3, 3)), ("axis", (3,)), ("anchor", (3,))):
            array = frozen(getattr(self, name))
            if array.shape != shape or not np.isfinite(array).all():
                raise KinematicsError(f"joint {self.name}: {name} = {array.tolist()} must be finite, of shape {shape}")
            object.__setattr__(self, name, array)
        length = np.linalg.norm(self.axis)
        if length == 0:
            raise KinematicsError(f"joint {self.name}: the axis has no length")
        if not np.allclose(self.rotation @ self.rotation.T, np.eye(3), atol=1e-6) or np.linalg.det(self.rotation) < 0:
            raise KinematicsError(f"joint {self.name}: {self.rotation.tolist()} is not a rotation")
        object.__setattr__(self, "axis", frozen(_clean(self.axis / length)))
        object.__setattr__(self, "rotation", frozen(_clean(self.rotation)))


@dataclass(frozen=True)
class Coupling:
    """A drive whose motor turns with several joints, theta = weights' q."""

    name: str
    """Of the drive."""
    weights: tuple[float, ...]
    """One per joint; 0 for those with which it does not turn."""
    armature: bool = True
    """Whether it adds an inertia of its own."""
    spring: float | None = None
    """Position of the motor [rad] at which a spring on it makes no torque, if it has one."""

    def __post_init__(self) -> None:
        if not np.isfinite(self.weights).all() or not np.any(self.weights):
            raise KinematicsError(f"coupling {self.name}: weights {self.weights} must be finite, and not all 0")


@dataclass(frozen=True, eq=False)
class KinematicTree:
    """A tree of links on the ground, a joint each, with bodies that are welded together as one link.

    Raises
    ------
    KinematicsError
        If there is no joint, two have one name, or a parent does not come before its child.
    """

    name: str
    """Of the robot."""
    joints: tuple[Joint, ...]
    """In the order of a log's columns; parents come before their children."""
    gravity: Array
    """[m/s^2], in the frame of the ground, shape (3,)."""
    couplings: tuple[Coupling, ...] = ()
    """Drives that turn with several joints."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "gravity", frozen(self.gravity))
        names = [joint.name for joint in self.joints]
        if not names:
            raise KinematicsError(f"robot {self.name!r} has no joints")
        if twice := sorted({name for name in names if names.count(name) > 1}):
            raise KinematicsError(f"robot {self.name!r} has two joints of the name {', '.join(twice)}")
        for j, joint in enumerate(self.joints):
            if not GROUND <= joint.parent < j:
                raise KinematicsError(f"joint {joint.name}: its parent, number {joint.parent}, does not come before it")

    @property
    def n(self) -> int:
        """Number of joints."""
        return len(self.joints)

    def ancestors(self, link: int) -> tuple[int, ...]:
        """Return the joints that move a link, from the ground to its own."""
        chain = [link]
        while (parent := self.joints[chain[-1]].parent) != GROUND:
            chain.append(parent)
        return tuple(reversed(chain))


def _clean(values: Array) -> Array:
    near = np.abs(values - np.round(values)) < ROUNDING
    return np.where(near, np.round(values), values) + 0.0


MIN_LIMIT = 1e-6  # Limits below this are a slip


@dataclass(frozen=True, eq=False)
class Limits:
    """Limits of the joints; infinite where there are none."""

    position: Array
    """Lowest and highest [rad], finite, shape (joint, 2)."""
    velocity: Array
    """Largest speed, finite [rad/s], shape (joint,)."""
    acceleration: Array
    """Largest acceleration [rad/s^2], shape (joint,)."""
    jerk: Array
    """Largest jerk [rad/s^3], shape (joint,)."""
    torque: Array
    """Largest torque [N m], shape (joint,)."""
    rms_torque: Array
    """Largest rms torque of the motion [N m], shape (joint,)."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "position", frozen(self.position))
        n = len(self.position)
        for name in ("velocity", "acceleration", "jerk", "torque", "rms_torque"):
            values = frozen(np.broadcast_to(getattr(self, name), n))
            if not (values >= MIN_LIMIT).all():
                raise SettingError(f"limits: {name} = {values.tolist()} must be at least {MIN_LIMIT:g}")
            object.__setattr__(self, name, values)
        if self.position.shape != (n, 2) or not (self.position[:, 0] < self.position[:, 1]).all():
            raise SettingError(f"limits: position = {self.position.tolist()} must be pairs, the lowest first")

    @property
    def middle(self) -> Array:
        """Middle of the ranges [rad], shape (joint,)."""
        return np.asarray(self.position.mean(axis=1))

    @property
    def sizes(self) -> Array:
        """Half of the ranges, and the largest velocity, acceleration and jerk, shape (4, 1, joint)."""
        half = np.diff(self.position, axis=1)[:, 0] / 2
        return np.stack([half, self.velocity, self.acceleration, self.jerk])[:, None]
