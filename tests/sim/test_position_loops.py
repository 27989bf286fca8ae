"""What actuators of a file state of their loops: forces of MuJoCo itself, state by state."""

import mujoco
import numpy as np
import pytest

from idbench.identify.files.servo_file import ServoFile
from idbench.identify.servo.law import TimeSteps
from idbench.sim.robot.position_loops import position_loops
from idbench.sim.robot.time_steps import steps_of

ARM = """
<mujoco><option timestep="0.004" integrator="{integrator}"/><worldbody>
  <body><joint name="one" axis="0 1 0" damping="0.1" frictionloss="0.05" armature="0.01"/>
    <inertial pos="0 0 -0.2" mass="1" diaginertia="0.01 0.01 0.01"/></body>
</worldbody><actuator>{actuator}</actuator></mujoco>
"""

ACTUATORS = [
    '<position name="a" joint="one" kp="20" kv="1.5" forcerange="-3 3"/>',
    '<position name="a" joint="one" kp="20" dampratio="1" timeconst="0.02"/>',
    '<velocity name="a" joint="one" kv="3" forcerange="-2 2"/>',
    '<general name="a" joint="one" gear="3" gainprm="2" biastype="affine" biasprm="0.4 -2 -0.1" forcerange="-4 4"/>',
    '<dcmotor name="a" joint="one" motorconst="0.5" resistance="3" input="pos" controller="2 0 0.1 0 0 11.6"/>',
]


@pytest.fixture
def robot_of(load_robot):
    return lambda actuator, integrator="Euler": load_robot(ARM.format(actuator=actuator, integrator=integrator))


def torque(servo, loop, u, q, qd):
    """Return tau = a V sat(gain kp (angle - q) - kd qd + forward) - b qd of what is stated; a and b of a motor by its K, R."""
    angle, forward = loop.commanded(u)
    wanted = servo.slope * (angle - q) - servo.kd * qd + forward
    sat = np.clip(wanted, -servo.limit, servo.limit)
    K, R = 0.5, 3.0
    return K / R * servo.supply * sat - K**2 / R * qd if servo.kind == "duty" else sat


@pytest.mark.parametrize("actuator", ACTUATORS)
def test_loops_make_the_forces_of_mujoco(robot_of, actuator):
    robot = robot_of(actuator)
    (loop,) = position_loops(robot).values()
    assert loop.actuator == "a"
    servo = ServoFile({}, {"one": dict(loop.stated)}, {}).servo("one", "")
    model, data, rng = robot.model, mujoco.MjData(robot.model), np.random.default_rng(0)
    for _ in range(50):
        data.qpos, data.qvel, data.ctrl = rng.uniform(-1, 1, (3, 1))
        if model.na:
            data.act[:] = data.ctrl[0]  # a low-pass that has followed
        mujoco.mj_forward(model, data)
        expected = torque(servo, loop, data.ctrl[0], data.qpos[0], data.qvel[0])
        assert data.qfrc_actuator[0] == pytest.approx(expected, abs=1e-9)


def test_motors_and_tendons_close_no_loop(robot_of):
    assert position_loops(robot_of('<motor joint="one"/>')) == {}
    assert position_loops(robot_of('<intvelocity joint="one" kp="3" actrange="-1 1"/>')) == {}


@pytest.mark.parametrize(
    ("integrator", "expected"), [("Euler", (0.002, -0.002, 0.002)), ("implicitfast", (0.002, 0.002, 0.002)), ("RK4", (0, 0, 0))]
)
def test_what_integrators_take_late(robot_of, integrator, expected):
    steps = TimeSteps(*steps_of(robot_of(ACTUATORS[0], integrator))["one"])
    assert steps[:3] == pytest.approx(expected)
    assert steps.step == 0.004
    assert steps.decay == pytest.approx(2 / (0.95 * 0.02))  # MuJoCo's own solref and solimp
    assert steps.yielding == pytest.approx(0.1 / 0.9 / (0.01 + 0.01 + 0.04))
