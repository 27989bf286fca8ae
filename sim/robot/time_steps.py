"""What MuJoCo's integrators make of the forces that depend on velocities, within one step."""

from collections.abc import Sequence

import mujoco
import numpy as np

from idbench.sim.robot.inverse_dynamics import inverse_dynamics
from idbench.sim.robot.motors import Array
from idbench.sim.robot.robot import Robot

POSITION, VELOCITY = 1, 2  # Places of what multiplies them among the numbers of an actuator's bias: -kp and -kv of `position`


def apparent_rotor_inertia(robot: Robot) -> Array:
    """Apparent additional rotor inertia in torques that the robot's own actuators made, shape (joint,) [kg m^2, kg].

    h (kv + D / 2) by the implicit integrators, h D / 2 by Euler's, -h D / 2 where `eulerdamp` is disabled, and h kv / 2 by RK4:
    see `torque_of_steps`.
    """
    model, h = robot.model, robot.model.opt.timestep
    if _is(robot, mujoco.mjtIntegrator.mjINT_RK4):
        return h / 2 * actuator_damping(robot)
    side = 1 if _is(robot, mujoco.mjtIntegrator.mjINT_IMPLICIT) else -1
    return np.asarray(h * (_at_the_end(robot) + side * model.dof_damping / 2))


def torque_of_steps(robot: Robot, motion: Sequence[Array]) -> Array:
    """Difference of a simulation's torques from those of the motion through its positions, shape (time, joint) [N m, N].

    `motion` has the logged positions [rad] and their first four derivatives, shape (time, joint) each.

    MuJoCo steps by v(k+1) = v(k) + h a(k), q(k+1) = q(k) + h v(k+1), so that a(k) is the acceleration at q(k), and v(k) the
    velocity half a step before. Its implicit integrators take forces that depend on velocities at the end of the step, where
    `qfrc_actuator` has them at its beginning:

        tau(k) = M a(k) + c(q(k), v(k)) + D v(k+1) + kv (v(k+1) - v(k)),   a = qdd + h^2/12 d^2 qdd/dt^2,
        v(k) = qd - h/2 qdd + h^2/6 dqdd/dt,   v(k+1) = qd + h/2 qdd + h^2/6 dqdd/dt

    with the Coriolis torques of v(k+1) by `implicit`; Euler takes the joints' damping alone at the end, and not even that if
    `eulerdamp` is disabled. By Runge-Kutta a control acts for a whole step on the joint as it moves within: the mean of the
    step, `acting_late` after its beginning, is tau(k) - h/2 (kp qd + kv qdd) - h^2/6 (kp qdd + kv dqdd/dt).
    """
    q, qd, qdd, jerk, snap = motion
    h = robot.model.opt.timestep
    if _is(robot, mujoco.mjtIntegrator.mjINT_RK4):
        kp, kv = _of_bias(robot, POSITION), actuator_damping(robot)
        return np.asarray(h / 2 * (kp * qd + kv * qdd) + h**2 / 6 * (kp * qdd + kv * jerk))
    side = 1 if _is(robot, mujoco.mjtIntegrator.mjINT_IMPLICIT) else -1
    v, a = qd + side * h / 2 * qdd + h**2 / 6 * jerk, qdd + h**2 / 12 * snap
    return np.asarray(inverse_dynamics(robot, q, v, a) - inverse_dynamics(robot, q, qd, qdd) + h * _at_the_end(robot) * a)


def _at_the_end(robot: Robot) -> Array:
    """Return the damping that the integrator takes at the end of a step, and not at its beginning, shape (joint,)."""
    model = robot.model
    if _is(robot, mujoco.mjtIntegrator.mjINT_IMPLICIT):
        return actuator_damping(robot)  # that of joints is in the velocity of the end
    if not _is(robot, mujoco.mjtIntegrator.mjINT_EULER):
        return np.asarray(model.dof_damping + actuator_damping(robot))
    explicit = model.opt.disableflags & int(mujoco.mjtDisableBit.mjDSBL_EULERDAMP)
    return np.zeros(robot.n) if explicit else np.array(model.dof_damping)


def acting_late(robot: Robot) -> float:
    """How much later than logged the torques of `torque_of_steps` act [s]."""
    return float(robot.model.opt.timestep / 2) if _is(robot, mujoco.mjtIntegrator.mjINT_RK4) else 0.0


def actuator_damping(robot: Robot) -> Array:
    """Return kv of the actuators of each joint, such as `position` and `velocity`, shape (joint,) [N m s/rad, N s/m]."""
    return _of_bias(robot, VELOCITY)


def _of_bias(robot: Robot, place: int) -> Array:
    model, found = robot.model, np.zeros(robot.n)
    joint, affine = int(mujoco.mjtTrn.mjTRN_JOINT), int(mujoco.mjtBias.mjBIAS_AFFINE)
    for a in range(model.nu):
        if model.actuator_trntype[a] == joint and model.actuator_biastype[a] == affine:
            found[model.actuator_trnid[a, 0]] -= model.actuator_biasprm[a, place] * model.actuator_gear[a, 0] ** 2
    return found


def steps_of(robot: Robot) -> dict[str, tuple[float, ...]]:
    """Effect of the integrator on each joint that moves by commands, as `identify.servo.law.TimeSteps` has it, by name.

    A symplectic step takes damping D at its end as an inertia h D / 2, at its beginning as -h D / 2, where both are beside the
    mean of the two; and the control that is logged at an instant acts from half a step before (see `torque_of_steps`). Dry
    friction is a constraint: f = -(a + B v) / (A + R) within +-frictionloss, a being the acceleration without it, A = 1/M,
    B = 2 / (dmax timeconst) of its solref, R = (1 - d) / d A0 of its solimp, and A0 MuJoCo's A at the position of the file.
    """
    model = robot.model
    refsafe = not model.opt.disableflags & int(mujoco.mjtDisableBit.mjDSBL_REFSAFE)
    found = dict[str, tuple[float, ...]]()
    for j, name in enumerate(robot.joints):
        d, dmax = np.clip(model.dof_solimp[j, :2], 1e-4, 0.9999).tolist()
        timeconst, ratio = model.dof_solref[j].tolist()
        slowest = max(timeconst, 2 * model.opt.timestep if refsafe else 0.0)
        decay = 2 / (dmax * slowest) if timeconst > 0 else -ratio / dmax
        yielding = (1 - d) / d * float(model.dof_invweight0[j])
        found[name] = (*_step_times(robot), float(model.opt.timestep), yielding, decay)
    return found


def _step_times(robot: Robot) -> tuple[float, float, float]:
    """Return inertia per damping of a joint, and of a loop at it, and by how much a control acts early, all in s."""
    h = float(robot.model.opt.timestep)
    if _is(robot, mujoco.mjtIntegrator.mjINT_RK4):
        return 0.0, 0.0, 0.0
    implicit = not _is(robot, mujoco.mjtIntegrator.mjINT_EULER)
    explicit = bool(robot.model.opt.disableflags & int(mujoco.mjtDisableBit.mjDSBL_EULERDAMP)) and not implicit
    return (-h / 2 if explicit else h / 2), (h / 2 if implicit else -h / 2), h / 2


def integrator_name(robot: Robot) -> str:
    """MuJoCo's name of the integrator of a robot's file."""
    word = mujoco.mjtIntegrator(robot.model.opt.integrator).name.removeprefix("mjINT_")
    return {"EULER": "Euler", "RK4": "RK4"}.get(word, word.lower())


def _is(robot: Robot, integrator: mujoco.mjtIntegrator) -> bool:
    return int(robot.model.opt.integrator) == int(integrator)
