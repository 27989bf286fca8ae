"""Any robot's kinematic description and its true parameters, read from its compiled model."""

from collections.abc import Iterator, Sequence

import mujoco
import numpy as np

from idbench.identify.basis.block import named
from idbench.identify.data.kinematics import GROUND, INERTIAL, Coupling, Joint, KinematicTree
from idbench.sim.errors import RobotError
from idbench.sim.robot.motors import Array
from idbench.sim.robot.robot import Robot


def kinematic_tree(robot: Robot, couplings: Sequence[str] = ()) -> KinematicTree:
    """Return the tree of a robot's links; bodies that are welded to a link belong to it.

    A joint has an armature, or a spring, if the model gives it one. Drives that turn with several joints are its `fixed`
    tendons with rotor, friction or spring, and those that `couplings` name.

    Raises
    ------
    RobotError
        If equality constraints or spatial tendons close chains or couple joints; they are named.

    Examples
    --------
    >>> from idbench.sim import kinematic_tree, load_robot
    >>> [joint.kind for joint in kinematic_tree(load_robot("scara")).joints]
    ['hinge', 'hinge']
    """
    model = robot.model
    _require_open(robot)
    joints: list[Joint] = []
    last = {0: GROUND}
    for body in range(1, model.nbody):
        first, count = model.body_jntadr[body], model.body_jntnum[body]
        if not count:
            continue
        parent, position, rotation = _placement(model, body)
        parent = last[parent]
        for k in range(first, first + count):
            at_first = k == first
            joints.append(
                Joint(
                    name=robot.joints[k],
                    kind="slide" if robot.slides[k] else "hinge",
                    parent=parent,
                    position=position if at_first else np.zeros(3),
                    rotation=rotation if at_first else np.eye(3),
                    axis=model.jnt_axis[k],
                    anchor=model.jnt_pos[k],
                    zero=float(model.qpos0[k]),
                    range=tuple(float(x) for x in robot.ranges[k]),  # type: ignore[arg-type]  # two of them
                    armature=bool(model.dof_armature[k] > 0),
                    massive=k == first + count - 1,
                    spring=float(model.qpos_spring[k]) if model.jnt_stiffness[k].any() else None,
                )
            )
            parent = k
        last[body] = parent
    gravity = np.zeros(3) if model.opt.disableflags & int(mujoco.mjtDisableBit.mjDSBL_GRAVITY) else model.opt.gravity
    return KinematicTree(robot.name, tuple(joints), gravity, tuple(_couplings(robot, couplings)))


def _couplings(robot: Robot, named: Sequence[str]) -> Iterator[Coupling]:
    """Yield the drives that turn with several joints."""
    model = robot.model
    for i in fixed_tendons(model):
        tendon, weights = model.tendon(i), np.zeros(robot.n)
        for wrap in range(model.tendon_adr[i], model.tendon_adr[i] + model.tendon_num[i]):
            weights[model.wrap_objid[wrap]] += model.wrap_prm[wrap]
        if tendon.name in named or _is_stiff(model, i) or model.tendon_armature[i]:
            name, rest = tendon_name(model, i), float(model.tendon_lengthspring[i].mean())
            armature = tendon.name in named or bool(model.tendon_armature[i])
            yield Coupling(name, tuple(map(float, weights)), armature, rest if model.tendon_stiffness[i].any() else None)


def fixed_tendons(model: mujoco.MjModel) -> list[int]:
    """Return the tendons that are sums of joints."""
    return [i for i in range(model.ntendon) if model.wrap_type[model.tendon_adr[i]] == int(mujoco.mjtWrap.mjWRAP_JOINT)]


def tendon_name(model: mujoco.MjModel, i: int) -> str:
    """Return the name of a tendon, or its number."""
    return model.tendon(i).name or f"tendon{i + 1}"


def standard_parameters(robot: Robot) -> dict[str, float]:
    """Return the true standard parameters: ten a link, armature, viscous and Coulomb friction of every joint.

    Inertias and first moments [kg m^2, kg m] are about the origin of the frame of the body that a joint moves, in its axes,
    with all bodies that are welded to it; see `idbench.identify.tree_basis` for the names.
    """
    model = robot.model
    found: dict[str, float] = {}
    for j in range(robot.n):
        body = int(model.jnt_bodyid[j])
        if j + 1 == robot.n or model.jnt_bodyid[j + 1] != body:
            inertia, first, mass = _inertial(model, body)
            values = *inertia[np.triu_indices(3)], *first, mass
            found |= {named(x, j): float(v) for x, v in zip(INERTIAL, values, strict=True)}
        for letters, field in (("Ia", "dof_armature"), ("Fv", "dof_damping"), ("Fs", "dof_frictionloss")):
            found[named(letters, j)] = float(getattr(model, field)[j])
        if model.jnt_stiffness[j].any():
            found[named("K", j)] = float(np.ravel(model.jnt_stiffness[j])[0])
    for i in fixed_tendons(model):
        for letters, field in TENDON.items():
            found[f"{letters}_{tendon_name(model, i)}"] = float(np.ravel(getattr(model, field)[i])[0])
    return found


TENDON = {"Ia": "tendon_armature", "Fv": "tendon_damping", "Fs": "tendon_frictionloss", "K": "tendon_stiffness"}
"""Letters of the parameters of drives that turn with several joints, and MuJoCo's fields of them."""


def _require_open(robot: Robot) -> None:
    """Raise RobotError if something other than the tree ties joints together."""
    model = robot.model
    ties = [_tie(model, i) for i in range(model.neq) if model.eq_active0[i]]
    spatial = [i for i in range(model.ntendon) if i not in fixed_tendons(model)]
    ties += [f"tendon {model.tendon(i).name!r}" for i in spatial if _is_stiff(model, i)]
    if ties:
        raise RobotError(
            f"robot {robot.name!r} is no open tree: {', '.join(ties)} closes a chain or couples joints; hold the "
            "joints that follow others (--lock JOINT=VALUE, or --joints with those of the log), or remove it from the file"
        )


def _tie(model: mujoco.MjModel, equality: int) -> str:
    """Return kind and name of an equality constraint, and what it ties."""
    kind = mujoco.mjtEq(model.eq_type[equality]).name.removeprefix("mjEQ_").lower()
    ends, name = (int(model.eq_obj1id[equality]), int(model.eq_obj2id[equality])), model.equality(equality).name
    of = model.joint if kind == "joint" else model.body if model.eq_objtype[equality] == mujoco.mjtObj.mjOBJ_BODY else None
    tied = f" ({' and '.join(of(i).name for i in ends if i >= 0)})" if of else ""
    return f"{kind} {name!r}{tied}" if name else f"{kind}{tied}"


def unmodelled(robot: Robot) -> list[str]:
    """Parts of a robot's file whose torques no parameter describes."""
    model = robot.model
    sprung = [robot.joints[j] for j in np.flatnonzero(model.jnt_stiffnesspoly.any(axis=1))]
    found = [f"springs that are not linear at {', '.join(sprung)}"] if sprung else []
    if model.body_gravcomp.any():
        found.append("gravity compensation (gravcomp)")
    if model.opt.density or model.opt.viscosity:
        found.append("a fluid (density, viscosity)")
    if model.dof_dampingpoly.any():
        found.append("damping that is not proportional to the velocity")
    return found


def _is_stiff(model: mujoco.MjModel, tendon: int) -> bool:
    fields = model.tendon_stiffness, model.tendon_damping, model.tendon_frictionloss
    return any(bool(np.any(field[tendon])) for field in fields)


def _placement(model: mujoco.MjModel, body: int) -> tuple[int, Array, Array]:
    """Return the nearest body above `body` that has joints, or the world, and where `body` stands in its frame."""
    position, rotation = np.array(model.body_pos[body]), _rotation(model.body_quat[body])
    parent = int(model.body_parentid[body])
    while parent and not model.body_jntnum[parent]:
        turned = _rotation(model.body_quat[parent])
        position, rotation = model.body_pos[parent] + turned @ position, turned @ rotation
        parent = int(model.body_parentid[parent])
    return parent, position, rotation


def _inertial(model: mujoco.MjModel, link: int) -> tuple[Array, Array, float]:
    """Return inertia matrix and first moments about the origin of a link's frame, and its mass, with what is welded to it."""
    inertia, first, mass = np.zeros((3, 3)), np.zeros(3), 0.0
    for body in (link, *(body for body in range(link + 1, model.nbody) if model.body_weldid[body] == link)):
        position, rotation = (np.zeros(3), np.eye(3)) if body == link else _placement(model, body)[1:]
        m, c = float(model.body_mass[body]), position + rotation @ model.body_ipos[body]
        axes = rotation @ _rotation(model.body_iquat[body])
        inertia += axes @ np.diag(model.body_inertia[body]) @ axes.T + m * (c @ c * np.eye(3) - np.outer(c, c))
        first += m * c
        mass += m
    return inertia, first, mass


def _rotation(quaternion: Array) -> Array:
    matrix = np.zeros(9)
    mujoco.mju_quat2Mat(matrix, quaternion)
    return matrix.reshape(3, 3)
