"""Robots given by a table of Denavit-Hartenberg parameters, as papers and makers' sheets have them."""

import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

from idbench.sim.errors import RobotError
from idbench.sim.robot.motors import Array
from idbench.sim.robot.urdf import SIZE, SMALL

TABLE = ".toml"  # What the name of such a file ends with

KHALIL, CLASSIC = "khalil-kleinfinger", "classic"

KNOWN = ("name", "convention", "angles", "gravity", "joints")
OF_JOINTS = ("name", "sigma", "alpha", "d", "theta", "range", "armature")  # Keys of a file, and of each of its joints
OF_CONVENTION = {KHALIL: ("parent", "gamma", "b", "r"), CLASSIC: ("a",)}  # And those that a convention has beside them

FARTHEST, STRONGEST = 1e6, 1e3
"""Lengths, angles and armatures, and accelerations of gravity [m/s^2], beyond which nothing of a robot lies."""

EXAMPLES = {2: "[-2.4, 2.4]", 3: "[0.0, 0.0, -9.81]"}  # Lists of so many numbers
RIGHT = 1e-5  # Angles [rad] this near to a multiple of a right angle are meant to be it: 1.5708


def from_table(path: Path) -> tuple[mujoco.MjSpec, list[str]]:
    """Return the description of a robot of a table of Denavit-Hartenberg parameters, and what was made up for it.

    Khalil and Kleinfinger (1986), also called modified: frame j stands in that of its antecedent by Rot(z, gamma)
    Trans(z, b) Rot(x, alpha) Trans(x, d) Rot(z, theta) Trans(z, r), and joint j turns about, or slides along, its own z.
    Classic: Rot(z, theta) Trans(z, d) Trans(x, a) Rot(x, alpha), and joint j moves about z of the frame before; the frame of
    link j is then that of its joint, parallel to the frame before. theta (r or d of a slide) is the joint's position at 0.

    Raises
    ------
    RobotError
        If the file cannot be read, or a key of it is missing or unknown.
    """
    try:
        stated = tomllib.loads(path.read_text(encoding="utf-8"))
    except (ValueError, RecursionError) as error:
        raise RobotError(f"{path}: {error}") from error
    try:
        return _described(path, stated)
    except (AttributeError, TypeError) as error:
        raise RobotError(
            f"{path}: a value is of the wrong kind ({error}): [[joints]] are tables, range and gravity lists"
        ) from error


def _described(path: Path, stated: Mapping[str, Any]) -> tuple[mujoco.MjSpec, list[str]]:
    _require_known(path, "", stated, KNOWN)
    convention = stated.get("convention", KHALIL)
    if convention not in (KHALIL, CLASSIC):
        raise RobotError(f"{path}: convention = {convention!r} is none of {KHALIL}, {CLASSIC}")
    if (scale := {"rad": 1.0, "deg": np.pi / 180}.get(str(stated.get("angles", "")))) is None:
        raise RobotError(f'{path}: say angles = "rad" or angles = "deg"')
    spec, bodies = mujoco.MjSpec(), dict[str, mujoco.MjsBody]()
    spec.compiler.degree = False
    spec.option.gravity = _numbers(path, "gravity", stated.get("gravity", [0.0, 0.0, -9.81]), 3, STRONGEST)
    last, distal = spec.worldbody, (np.zeros(3), np.eye(3))
    for number, joint in enumerate(stated.get("joints", [])):
        name = str(joint.get("name", f"joint{number + 1}"))
        _require_known(path, f"joint {name}", joint, OF_JOINTS + OF_CONVENTION[convention])
        values = _Values(path, name, joint, scale)
        if convention == KHALIL:
            if (of := joint.get("parent")) is not None and of not in bodies:
                raise RobotError(f"{path}: parent {of!r} is no joint before it; known: {', '.join(bodies) or 'none'}")
            parent = last if of is None else bodies[of]
            place, distal = values.khalil(), (np.zeros(3), np.eye(3))
        else:
            parent, place = last, distal
            distal = values.classic()
        bodies[name] = last = _body(parent, name, place, values)
    if not bodies:
        raise RobotError(f"{path} has no [[joints]]")
    return spec, ["no inertias, as a table has none: 1 g per link is assumed, which matters only for simulation"]


class _Values:
    """The parameters of one joint."""

    def __init__(self, path: Path, name: str, joint: Mapping[str, Any], scale: float) -> None:
        self._path = path
        self._name = name
        self._joint = joint
        self._scale = scale

    def length(self, key: str) -> float:
        return _number(self._path, f"joint {self._name}: {key}", self._joint.get(key, 0.0), FARTHEST)

    def angle(self, key: str) -> float:
        # Multiples of a right angle are meant exactly, however they are rounded.
        value = self.length(key) * self._scale
        quarter = np.round(value / (np.pi / 2)) * np.pi / 2
        return quarter if abs(value - quarter) < RIGHT else value

    @property
    def slides(self) -> bool:
        if (sigma := self._joint.get("sigma", 0)) not in (0, 1) or isinstance(sigma, bool):
            raise RobotError(f"{self._path}: joint {self._name}: sigma = {sigma!r} must be 0 (turns) or 1 (slides)")
        return bool(sigma)

    @property
    def range(self) -> list[float] | None:
        if (stated := self._joint.get("range")) is None:
            return None
        where = f"joint {self._name}: range"
        low, high = _numbers(self._path, where, stated, 2, FARTHEST)
        if not low < high:
            raise RobotError(
                f"{self._path}: {where} = [{low:g}, {high:g}]: the lowest is not below the highest; leave range out for a "
                "joint without limits"
            )
        scale = 1.0 if self.slides else self._scale
        return [scale * low, scale * high]

    def khalil(self) -> tuple[Array, Array]:
        """Pose of the joint's frame in that of its antecedent."""
        first = _turn("z", self.angle("gamma")) @ _turn("x", self.angle("alpha"))
        rotation = first @ _turn("z", self.angle("theta"))
        position = np.array([0, 0, self.length("b")]) + first @ [self.length("d"), 0, self.length("r")]
        return position, rotation

    def classic(self) -> tuple[Array, Array]:
        """Pose of the next frame in that of this joint."""
        turned = _turn("z", self.angle("theta"))
        return np.array([0, 0, self.length("d")]) + turned @ [self.length("a"), 0, 0], turned @ _turn("x", self.angle("alpha"))


def _body(parent: mujoco.MjsBody, name: str, place: tuple[Array, Array], values: _Values) -> mujoco.MjsBody:
    quaternion = np.zeros(4)
    mujoco.mju_mat2Quat(quaternion, np.ascontiguousarray(place[1]).ravel())
    body = parent.add_body(name=f"link of {name}", pos=place[0], quat=quaternion)
    body.mass = SMALL
    body.inertia = [SMALL * SIZE**2] * 3
    body.explicitinertial = True
    kind = mujoco.mjtJoint.mjJNT_SLIDE if values.slides else mujoco.mjtJoint.mjJNT_HINGE
    joint = body.add_joint(name=name, type=kind, axis=[0, 0, 1], armature=values.length("armature"))
    if values.range is not None:
        joint.range, joint.limited = values.range, mujoco.mjtLimited.mjLIMITED_TRUE
    return body


def _number(path: Path, where: str, stated: object, most: float) -> float:
    """Return a number of a table; raise RobotError if it is none, or larger than any of a robot."""
    if isinstance(stated, bool) or not isinstance(stated, (int, float)) or not abs(stated) <= most:
        raise RobotError(f"{path}: {where} = {stated!r:.60} must be a number from -{most:g} to {most:g}")
    return float(stated)


def _numbers(path: Path, where: str, stated: object, count: int, most: float) -> list[float]:
    """Return numbers of a table; raise RobotError if they are not as many."""
    if not isinstance(stated, list) or len(stated) != count:
        raise RobotError(f"{path}: {where} = {stated!r:.60} must be a list of {count} numbers, such as {EXAMPLES[count]}")
    return [_number(path, where, each, most) for each in stated]


def _turn(axis: str, angle: float) -> Array:
    c, s = (np.round(x) if abs(x - np.round(x)) < 1e-15 else x for x in (np.cos(angle), np.sin(angle)))
    if axis == "x":
        return np.array([[1, 0, 0], [0, c, -s], [0, s, c]])
    return np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])


def _require_known(path: Path, where: str, stated: Mapping[str, Any], known: tuple[str, ...]) -> None:
    if wrong := [key for key in stated if key not in known]:
        raise RobotError(f"{path}: {where + ': ' if where else ''}{', '.join(wrong)} is unknown; known: {', '.join(known)}")
