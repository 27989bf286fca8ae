"""How a robot is mounted and which of its joints a log has: a file describes more than a log shows."""

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import mujoco
import numpy as np

from idbench.identify.basis.block import named
from idbench.identify.plugins import did_you_mean
from idbench.sim.errors import RobotError
from idbench.sim.robot.motors import Array


@dataclass(frozen=True)
class Mounting:
    """How a robot is mounted, and which of its joints move."""

    joints: tuple[str, ...] = ()
    """Joints of the log, in the order of the robot's file or in another; empty for all. The others are held at 0, or where
    `lock` says."""
    lock: tuple[tuple[str, float], ...] = ()
    """Joints that do not move, and where they are held [rad, m]."""
    gravity: tuple[float, float, float] | None = None
    """[m/s^2] in the frame of the robot's base; by default what the file says, -9.81 along z in a URDF."""
    couplings: tuple[tuple[str, tuple[tuple[str, float], ...]], ...] = ()
    """Drives whose motor turns with several joints: name, and joints with what the motor turns for a turn of each."""

    @property
    def plain(self) -> bool:
        """Whether the robot stays as its file describes it."""
        return self == Mounting()

    def edit(self, spec: mujoco.MjSpec) -> None:
        """Hold the joints that do not move, and turn gravity.

        Raises
        ------
        RobotError
            If a joint is unknown, of several degrees of freedom, or nothing is left that moves.
        """
        if self.gravity is not None:
            if not np.isfinite(self.gravity).all():
                raise RobotError(f"--gravity {self.gravity} must be three finite numbers [m/s^2]")
            spec.option.gravity = self.gravity
        names = [joint.name for joint in spec.joints]
        for name in (*self.joints, *(name for name, _ in self.lock)):
            if name not in names:
                raise RobotError(f"there is no joint {name!r}{did_you_mean(name, names)}; the robot's: {', '.join(names)}")
        held = dict.fromkeys((name for name in names if self.joints and name not in self.joints), 0.0) | dict(self.lock)
        if both := [name for name in self.joints if name in dict(self.lock)]:
            raise RobotError(f"{', '.join(both)}: both among --joints and locked")
        if held and len(held) == len(names):
            raise RobotError("all joints are locked: nothing is left to identify")
        if held:
            forget(spec, set(held), names)
        for joint in [joint for joint in spec.joints if joint.name in held]:
            _hold(spec, joint, held[joint.name])
        for name, weights in self.couplings:
            _couple(spec, name, weights)


FIELDS = {"Ia": "armature", "Fv": "damping", "Fs": "frictionloss"}
"""Letters of parameters of a joint, and MuJoCo's attributes of joints that hold their values."""


def with_values(values: Mapping[str, float | None]) -> Callable[[mujoco.MjSpec], None]:
    """Edit that gives the joints of a robot these armatures and frictions, by the parameter's name; None changes nothing."""

    def edit(spec: mujoco.MjSpec) -> None:
        for j, joint in enumerate(spec.joints):
            for letters, field in FIELDS.items():
                if (value := values.get(named(letters, j))) is not None:
                    stated = np.array(getattr(joint, field), dtype=np.float64)
                    stated.flat[0] = value  # damping is a polynomial of the velocity, the first coefficient of which is Fv
                    setattr(joint, field, stated if stated.ndim else value)

    return edit


MIN_FACTOR, MAX_FACTOR = 1e-6, 1e6  # Sizes of a coupling's factors beyond which they are slips
PLAIN = Mounting()  # As the file describes it


def _couple(spec: mujoco.MjSpec, name: str, weights: Sequence[tuple[str, float]]) -> None:
    """Add a drive that turns with several joints: a fixed tendon."""
    joints = [joint.name for joint in spec.joints]
    if name in joints:
        raise RobotError(
            f"--coupling {name}: that is the name of a joint, whose parameters would have like names: take another"
        )
    named = [joint for joint, _ in weights]
    if twice := sorted({joint for joint in named if named.count(joint) > 1}):
        raise RobotError(f"--coupling {name}: {', '.join(twice)} is given twice: add its factors up")
    if wrong := [f"{weight:g}*{joint}" for joint, weight in weights if not MIN_FACTOR <= abs(weight) <= MAX_FACTOR]:
        raise RobotError(
            f"--coupling {name}: {', '.join(wrong)}: a factor must be from {MIN_FACTOR:g} to {MAX_FACTOR:g} in size; leave out "
            "joints with which the motor does not turn"
        )
    if len(weights) < 2:
        raise RobotError(
            f"--coupling {name}: {named[0]} alone is a drive of its own, which every joint has: name two joints or more, or "
            "--armature all for its rotor"
        )
    if name in [tendon.name for tendon in spec.tendons]:
        raise RobotError(f"--coupling {name}: the robot's file has a tendon of this name already")
    tendon = spec.add_tendon(name=name)
    for joint, weight in weights:
        if joint not in joints:
            raise RobotError(
                f"--coupling {name}: there is no joint {joint!r}{did_you_mean(joint, joints)}; the robot's: {', '.join(joints)}"
            )
        tendon.wrap_joint(joint, weight)


def _hold(spec: mujoco.MjSpec, joint: mujoco.MjsJoint, value: float) -> None:
    """Weld a body to its parent, where its joint has a value."""
    if joint.type in (mujoco.mjtJoint.mjJNT_FREE, mujoco.mjtJoint.mjJNT_BALL):
        spec.delete(joint)
        return
    body, axis = joint.parent, np.array(joint.axis) / np.linalg.norm(joint.axis)
    if len(list(body.joints)) > 1:
        raise RobotError(
            f"{joint.name} is one of several joints of body {body.name!r}, which cannot be held one by one: give each "
            "a body of its own in the file"
        )
    in_degrees = spec.compiler.degree and joint.type == mujoco.mjtJoint.mjJNT_HINGE
    turned, way = _orientation(spec, body), value - float(joint.ref) * (np.pi / 180 if in_degrees else 1.0)
    if joint.type == mujoco.mjtJoint.mjJNT_SLIDE:
        body.pos = np.array(body.pos) + _rotated(turned, axis * way)
    else:
        about, rotation = np.array(joint.pos), np.zeros(4)
        mujoco.mju_axisAngle2Quat(rotation, axis, way)
        final = np.zeros(4)
        mujoco.mju_mulQuat(final, turned, rotation)
        body.pos = np.array(body.pos) + _rotated(turned, about) - _rotated(final, about)
        body.quat = final
        body.alt = mujoco.MjSpec().worldbody.add_body().alt  # the quaternion holds
    spec.delete(joint)


def _orientation(spec: mujoco.MjSpec, body: mujoco.MjsBody) -> Array:
    """Return the orientation of a body as a quaternion, however its file states it."""
    model = body.alt
    if model.type == mujoco.mjtOrientation.mjORIENTATION_QUAT:
        return np.array(body.quat, dtype=np.float64) / np.linalg.norm(body.quat)
    alone = mujoco.MjSpec()
    alone.compiler.degree, alone.compiler.eulerseq = spec.compiler.degree, spec.compiler.eulerseq
    copy = alone.worldbody.add_body(name="copy")
    copy.alt = model
    copy.add_geom(size=[1.0, 0.0, 0.0])
    return np.array(alone.compile().body("copy").quat)


def _rotated(quaternion: Array, vector: Array) -> Array:
    found = np.zeros(3)
    mujoco.mju_rotVecQuat(found, vector, quaternion)
    return found


def forget(spec: mujoco.MjSpec, held: set[str], names: Sequence[str]) -> None:
    """Take out what refers to joints that will be no more: ties, actuators, sensors, keyframes, entries of limits."""
    left = [j for j, name in enumerate(names) if name not in held]
    for numeric in [x for x in spec.numerics if x.name.startswith("max_") and len(x.data) == len(names) > 1]:
        numeric.data, numeric.size = np.array(numeric.data)[left], len(left)
    for equality in [e for e in spec.equalities if e.type == mujoco.mjtEq.mjEQ_JOINT and {e.name1, e.name2} & held]:
        spec.delete(equality)
    gone = {tendon.name for tendon in spec.tendons if _wraps(tendon, held)}
    for tendon in [tendon for tendon in spec.tendons if tendon.name in gone]:
        spec.delete(tendon)
    actuators = {a.name for a in spec.actuators if a.target in held | gone}
    for actuator in [a for a in spec.actuators if a.target in held | gone]:
        spec.delete(actuator)
    for sensor in [s for s in spec.sensors if s.objname in held | gone | actuators]:
        spec.delete(sensor)
    for key in list(spec.keys):
        spec.delete(key)


def _wraps(tendon: mujoco.MjsTendon, held: set[str]) -> bool:
    path = tendon.path
    return any(getattr(path[i].target, "name", "") in held for i in range(len(path)))


def locked(texts: Sequence[str]) -> tuple[tuple[str, float], ...]:
    """Return joints and values of texts such as finger=0.02; raise RobotError if one is none."""
    found = []
    for text in texts:
        name, _, value = text.partition("=")
        try:
            found.append((name, float(value)))
            if not np.isfinite(found[-1][1]):
                raise ValueError
        except ValueError:
            raise RobotError(f"--lock {text}: give a joint and where it is held [rad, m], such as finger=0.02") from None
    return tuple(found)


def coupled(texts: Sequence[str]) -> tuple[tuple[str, tuple[tuple[str, float], ...]], ...]:
    """Return drives and joints of texts such as motor6=joint_5+joint_6, or motor2=q2-0.5*q3; RobotError if one is none."""
    found = []
    for text in texts:
        name, _, terms = text.partition("=")
        parts = TERM.findall(terms)
        read = "".join("".join(part) for part in parts)
        if not re.fullmatch(r"[A-Za-z]\w*", name) or not parts or read != terms.replace(" ", ""):
            raise RobotError(
                f"--coupling {text}: give a name and what its motor turns with, such as motor6=joint_5+joint_6 or m=a-0.5*b"
            )
        found.append((name, tuple((joint, float(f"{sign}{factor.rstrip('*') or '1'}")) for sign, factor, joint in parts)))
    return tuple(found)


TERM = re.compile(r"([+-]?)((?:\d*\.)?\d+(?:[eE][+-]?\d+)?\*|)([A-Za-z_][\w./:]*)")  # A joint with a sign and a factor


def hold_bases(spec: mujoco.MjSpec) -> Iterator[str]:
    """Hold bodies that float where the file has them; yield a note."""
    if not (floating := [joint for joint in spec.joints if joint.type == mujoco.mjtJoint.mjJNT_FREE]):
        return
    bodies = ", ".join(joint.parent.name or joint.name for joint in floating)
    forget(spec, {joint.name for joint in floating}, [joint.name for joint in spec.joints])
    for joint in floating:
        spec.delete(joint)
    yield f"a base that floats, {bodies}: it is held where the file has it"


def drop_ties(spec: mujoco.MjSpec) -> Iterator[str]:
    """Leave out ties of bodies that move as one, since joints between them are held, or of a mocap body; yield a note."""
    if not any(tie.type in (mujoco.mjtEq.mjEQ_CONNECT, mujoco.mjtEq.mjEQ_WELD) for tie in spec.equalities):
        return
    model = spec.compile()
    idle = [_bodies(model, i) for i in range(model.neq)]
    dropped = [tie for tie, bodies in zip(list(spec.equalities), idle, strict=True) if bodies]
    for tie in dropped:
        spec.delete(tie)
    if dropped:
        each = ", ".join(" and ".join(bodies) for bodies in idle if bodies)
        yield f"ties that hold nothing that moves ({each}): they are left out"


def _bodies(model: mujoco.MjModel, tie: int) -> tuple[str, ...]:
    """Return the bodies of a tie that holds nothing that moves; none of another."""
    if model.eq_type[tie] not in (int(mujoco.mjtEq.mjEQ_CONNECT), int(mujoco.mjtEq.mjEQ_WELD)):
        return ()
    ends = int(model.eq_obj1id[tie]), max(int(model.eq_obj2id[tie]), 0)
    if model.eq_objtype[tie] == int(mujoco.mjtObj.mjOBJ_SITE):
        ends = int(model.site_bodyid[ends[0]]), int(model.site_bodyid[ends[1]])
    one = model.body_weldid[ends[0]] == model.body_weldid[ends[1]]
    mocap = any(model.body_mocapid[body] >= 0 for body in ends)
    return tuple(model.body(body).name for body in ends) if one or mocap else ()
