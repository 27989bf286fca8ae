"""What an integrator makes of a step, taken out of the torques that MuJoCo's own actuators made."""

import mujoco
import numpy as np
import pytest

from idbench.sim.robot.inverse_dynamics import coulomb_torque, inverse_dynamics
from idbench.sim.robot.time_steps import acting_late, actuator_damping, apparent_rotor_inertia, torque_of_steps

H = 0.002
INNER = slice(500, -20)  # Without the ends, where differences are none

ARM = """<mujoco><option timestep="0.002" integrator="{}"><flag {}/></option>
<default><joint damping="0.7" armature="0.02" frictionloss="0"/></default><worldbody>
<body><joint name="a" axis="0 1 0"/><inertial pos="0 0 .2" mass="2" diaginertia=".05 .04 .02"/>
<body pos="0 0 .4"><joint name="b" axis="1 0 0"/><inertial pos=".05 0 .15" mass="1" diaginertia=".02 .02 .01"/></body></body>
</worldbody><actuator><position joint="a" kp="100" kv="6"/><position joint="b" kp="20" kv="1" gear="2"/></actuator></mujoco>"""


def simulated(model):
    """Return positions and torques of a plain simulation, logged before each step."""
    data, q, tau = mujoco.MjData(model), [], []
    for k in range(3000):
        data.ctrl = np.sin(np.array([2.1, 3.3]) * k * H) * (1 - np.exp(-3 * k * H))
        mujoco.mj_forward(model, data)
        q.append(data.qpos.copy())
        tau.append(data.qfrc_actuator.copy())
        mujoco.mj_step(model, data)
    return np.array(q), np.array(tau)


def slope(x):
    """Return the derivative by fourth-order differences at one step."""
    return (np.roll(x, 2, axis=0) - 8 * np.roll(x, 1, axis=0) + 8 * np.roll(x, -1, axis=0) - np.roll(x, -2, axis=0)) / (12 * H)


def of_positions(robot, q):
    """Return positions with their first four derivatives, and the torques that they take by MuJoCo."""
    motion = [q]
    for _ in range(4):
        motion.append(slope(motion[-1]))
    return motion, inverse_dynamics(robot, *motion[:3]) + coulomb_torque(robot, motion[1])


@pytest.mark.parametrize(
    ("integrator", "flag", "left"),
    [
        ("implicitfast", "", 1e-4),
        ("Euler", "", 1e-4),
        ("Euler", 'eulerdamp="disable"', 1e-4),
        ("implicit", "", 3e-3),  # its Coriolis torques are linearized about the beginning of the step
    ],
)
def test_torques_of_every_integrator_become_those_of_the_motion(load_robot, integrator, flag, left):
    """Inverse dynamics of the positions, by MuJoCo, is another route than its step; errors are over what is corrected."""
    robot = load_robot(ARM.format(integrator, flag))
    q, tau = simulated(robot.model)
    motion, expected = of_positions(robot, q)
    extra = torque_of_steps(robot, motion)
    off = np.sqrt(np.mean(((tau - extra) - expected)[INNER] ** 2, axis=0) / np.mean(tau[INNER] ** 2, axis=0))
    assert (off < left).all()
    before = np.sqrt(np.mean((tau - expected)[INNER] ** 2, axis=0) / np.mean(tau[INNER] ** 2, axis=0))
    assert (before > 10 * off).all()


def test_a_control_of_runge_kutta_acts_in_the_middle_of_its_step_with_what_it_meets_on_the_way(load_robot):
    """Torques of the motion half a step later, by the mean of two instants; positions are exact to the fourth order."""
    robot = load_robot(ARM.format("RK4", ""))
    q, tau = simulated(robot.model)
    motion, expected = of_positions(robot, q)
    expected = (expected + np.roll(expected, -1, axis=0)) / 2
    off, before = (np.sqrt(np.mean((x - expected)[INNER] ** 2, axis=0)) for x in (tau - torque_of_steps(robot, motion), tau))
    assert acting_late(robot) == H / 2
    assert (off < 0.05 * before).all()


@pytest.mark.parametrize(
    ("integrator", "flag", "kv", "half"),
    [
        ("implicitfast", "", 1, 1),
        ("implicit", "", 1, 1),
        ("Euler", "", 0, 1),
        ("Euler", 'eulerdamp="disable"', 0, -1),
        ("RK4", "", 0.5, 0),
    ],
)
def test_what_seems_inertia_is_that_of_the_damping_at_the_end_of_a_step(load_robot, integrator, flag, kv, half):
    robot, damping = load_robot(ARM.format(integrator, flag)), np.array([6.0, 4.0])
    np.testing.assert_allclose(actuator_damping(robot), damping)
    np.testing.assert_allclose(apparent_rotor_inertia(robot), H * (kv * damping + half * 0.35), atol=1e-12)
