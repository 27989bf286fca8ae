"""The true parameters of a planar two-joint arm, computed from its compiled model."""

import mujoco
import numpy as np

from idbench.sim.errors import RobotError
from idbench.sim.robot.inverse_dynamics import inverse_dynamics
from idbench.sim.robot.motors import Array
from idbench.sim.robot.robot import Robot


def scara_truth(robot: Robot) -> dict[str, float]:
    """Return ZZR1, Fv1, Fs1, ZZ2, LMX2, LMY2, Fv2, Fs2 of a compiled planar arm with two vertical hinges.

    From masses, placements, inertias, armature, damping and frictionloss, with the definitions of the paper's section
    7.1. Bodies that are welded to a link count as part of it.

    Raises
    ------
    RobotError
        If the robot is not such an arm, or its inverse dynamics has more in it than these eight parameters express.
    """
    model = robot.model
    data = mujoco.MjData(model)
    data.qpos[:] = 0.0
    mujoco.mj_forward(model, data)
    if robot.n != 2 or not np.allclose(data.xaxis, [0, 0, 1]):
        raise RobotError(f"robot {robot.name!r} is not a planar arm with two vertical joints")
    if model.dof_armature[1]:
        raise RobotError(f"robot {robot.name!r} has armature {model.dof_armature[1]:g} on joint 2, a ninth parameter")
    zz1, _, _ = _about_joint(model, data, 0, np.array([1.0, 0.0, 0.0]))
    along = data.xanchor[1] - data.xanchor[0]
    along[2] = 0.0
    L = float(np.linalg.norm(along))
    if L == 0:
        raise RobotError(f"robot {robot.name!r} has both joints on one axis: no length of link 1 to speak of")
    zz2, mass2, first2 = _about_joint(model, data, 1, along / L)
    (Fv1, Fv2), (Fs1, Fs2) = model.dof_damping, model.dof_frictionloss
    truth = {
        "ZZR1": float(zz1 + model.dof_armature[0] + L**2 * mass2),
        "Fv1": float(Fv1),
        "Fs1": float(Fs1),
        "ZZ2": float(zz2),
        "LMX2": float(L * first2[0]),
        "LMY2": float(L * first2[1]),
        "Fv2": float(Fv2),
        "Fs2": float(Fs2),
    }
    _require_complete(robot, truth)
    return truth


def _about_joint(model: mujoco.MjModel, data: mujoco.MjData, joint: int, x_axis: Array) -> tuple[float, float, Array]:
    """Return moment of inertia about a joint's axis, mass, and first moments along and across `x_axis`, of its link."""
    zz, mass, first = 0.0, 0.0, np.zeros(2)
    across = np.cross([0.0, 0.0, 1.0], x_axis)
    for body in range(model.nbody):
        if model.body_weldid[body] != model.jnt_bodyid[joint]:
            continue
        m, arm = model.body_mass[body], data.xipos[body] - data.xanchor[joint]
        R = data.ximat[body].reshape(3, 3)
        zz += float(R[2] @ (model.body_inertia[body] * R[2]) + m * (arm[0] ** 2 + arm[1] ** 2))
        mass += float(m)
        first += m * np.array([arm @ x_axis, arm @ across])
    return zz, mass, first


def _require_complete(robot: Robot, X: dict[str, float]) -> None:
    """Raise RobotError unless the parameters give the robot's inverse dynamics, at some random states."""
    q, qd, qdd = np.random.default_rng(0).uniform(-3, 3, (3, 50, 2))
    c, s = np.cos(q[:, 1]), np.sin(q[:, 1])
    coupling, slope = X["LMX2"] * c - X["LMY2"] * s, -X["LMX2"] * s - X["LMY2"] * c
    tau2 = (X["ZZ2"] + coupling) * qdd[:, 0] + X["ZZ2"] * qdd[:, 1] - slope * qd[:, 0] ** 2
    tau1 = (X["ZZR1"] + coupling) * qdd[:, 0] + coupling * qdd.sum(axis=1) + X["ZZ2"] * qdd.sum(axis=1)
    tau1 += slope * qd[:, 1] * (2 * qd[:, 0] + qd[:, 1])
    expected = np.stack([tau1, tau2], axis=-1) + qd * [X["Fv1"], X["Fv2"]]
    missed = np.abs(inverse_dynamics(robot, q, qd, qdd) - expected).max()
    if not missed <= 1e-9 * np.abs(expected).max():  # nor if it is not a number
        raise RobotError(
            f"robot {robot.name!r} has forces that the eight parameters of a SCARA do not describe, up to {missed:.2g} N m: "
            "springs, tendons, fluid, friction of another kind, or gravity"
        )
