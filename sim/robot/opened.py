"""Files of robots that are no open tree of hinges and slides: what is held or left out so that they become one."""

from collections.abc import Iterator

import mujoco

from idbench.sim.robot.mounting import forget


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
