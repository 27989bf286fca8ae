"""Ideal torque against MuJoCo's own mj_inverse, one state at a time."""

import mujoco
import numpy as np

from idbench import models
from idbench.sim.engine.run import ideal_log
from idbench.sim.robot.inverse_dynamics import BLOCK, inverse_dynamics
from idbench.sim.robot.robot import Robot
from idbench.sim.scenario.scenario_file import load

ARM_WITH_GRAVITY = """
<mujoco>
  <option gravity="0 0 -9.81"/>
  <worldbody>
    <body name="a"><joint name="ja" axis="0 1 0" damping="0.3" armature="0.1" stiffness="2"/><geom size="0.1" pos="0.3 0 0"/>
      <body name="b" pos="0.6 0 0"><joint name="jb" axis="1 0 0"/><geom size="0.05" pos="0 0.2 0"/>
        <body name="c" pos="0 0.4 0"><joint name="jc" type="slide" axis="0 0 1"/><geom size="0.05"/></body>
      </body>
    </body>
  </worldbody>
</mujoco>
"""


def one_by_one(model, q, qd, qdd):
    data, tau = mujoco.MjData(model), np.empty_like(q)
    for k in range(len(q)):
        data.qpos[:], data.qvel[:], data.qacc[:] = q[k], qd[k], qdd[k]
        mujoco.mj_inverse(model, data)
        tau[k] = data.qfrc_inverse
    return tau


def test_the_torque_is_mj_inverse_without_frictionloss_plus_the_law_of_coulomb(table1):
    reference = table1.reference
    model = mujoco.MjModel.from_xml_path(str(models.path("scara")))
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_FRICTIONLOSS
    expected = one_by_one(model, reference.q, reference.qd, reference.qdd) + [0.5, 0.1] * np.sign(reference.qd)
    log = ideal_log(table1.robot, reference)
    np.testing.assert_allclose(log.tau, expected, atol=1e-12)
    np.testing.assert_array_equal(log.q, reference.q)
    assert (log.torque.meaning, log.torque.delay, log.fs) == ("instantaneous", 0.0, 100.0)


def test_the_trap_is_real(robot):
    """With frictionloss left on, mj_inverse gives braking joints the wrong sign: by 2 Fs somewhere on this motion."""
    reference = load("brisk").trajectory.sample(robot, 100.0)
    trapped = one_by_one(robot.model, reference.q, reference.qd, reference.qdd)
    assert np.abs(trapped - ideal_log(robot, reference).tau).max() > 0.5


def test_any_arm_with_gravity_springs_and_slides(rng):
    model = mujoco.MjModel.from_xml_string(ARM_WITH_GRAVITY)
    q, qd, qdd = rng.normal(size=(3, 300, 3))
    np.testing.assert_allclose(inverse_dynamics(Robot("arm", model), q, qd, qdd), one_by_one(model, q, qd, qdd), atol=1e-11)


def test_long_motions_are_cut_into_blocks(robot, rng):
    q, qd, qdd = rng.normal(size=(3, BLOCK + 5, 2))
    ends = slice(BLOCK - 5, BLOCK + 5)
    np.testing.assert_array_equal(
        inverse_dynamics(robot, q, qd, qdd)[ends], inverse_dynamics(robot, q[ends], qd[ends], qdd[ends])
    )


def test_the_robot_says_what_its_model_holds(robot):
    assert robot.joints == ("joint1", "joint2")
    np.testing.assert_array_equal(robot.ranges, [[-2.4, 2.4], [-2.2, 2.2]])
    np.testing.assert_array_equal(robot.torque_limits, [150, 15])
    unlimited = Robot("arm", mujoco.MjModel.from_xml_string(ARM_WITH_GRAVITY))
    assert np.isinf(unlimited.ranges).all()
    assert np.isinf(unlimited.torque_limits).all()
