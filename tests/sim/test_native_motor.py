"""The averaged drive beside MuJoCo's own `dcmotor`, given the same voltages: what differs is MuJoCo's step of the current."""

from dataclasses import replace
from itertools import pairwise

import mujoco
import numpy as np
import pytest

from idbench.sim.drives import AveragedDrive
from idbench.sim.engine.simulation import simulate
from idbench.sim.robot.robot import Robot
from idbench.sim.scenario.scenario_file import load
from idbench.sim.trajectories import RandomMoves


def motors():
    """R [Ohm], K [N m/A] and L [H] of the SCARA's motors, shape (joint,) each."""
    found = Robot.load("scara").motors
    return found.R, found.K, found.L


def native(h):
    """The SCARA with its motors as MuJoCo steps them, driven by a voltage, without cogging."""
    spec = mujoco.MjSpec.from_file(str(Robot.path("scara")))
    spec.option.timestep, spec.option.integrator = h, mujoco.mjtIntegrator.mjINT_EULER
    for motor in list(spec.actuators):
        spec.delete(motor)
    for joint, R, K, L in zip(spec.joints, *motors(), strict=True):
        made = spec.add_actuator(target=joint.name, trntype=mujoco.mjtTrn.mjTRN_JOINT)
        made.set_to_dcmotor(motorconst=[K, 0.0], resistance=R, inductance=[L, 0.0])
    return spec.compile()


@pytest.fixture(scope="module")
def run():
    moves = RandomMoves(moves=2, durations=(0.8, 0.8), rest=0.1)
    return simulate(replace(load("ideal"), drive=AveragedDrive(), trajectory=moves))


def off(run, h):
    """Rms difference of the positions [rad] where MuJoCo's motors get v = R i + L w (i_ref - i) + K qd at each of its steps."""
    model, log = native(h), run.alone()
    data, w = mujoco.MjData(model), 2 * np.pi * AveragedDrive().bandwidth
    R, K, L = motors()
    data.qpos[:], q = log.q[0], []
    for k in range(log.samples):
        q.append(data.qpos.copy())
        while data.time < (k + 1) / log.fs - h / 2:
            i = data.act
            data.ctrl[:] = R * i + L * w * (log.tau[k] / K - i) + K * data.qvel
            mujoco.mj_step(model, data)
    return float(np.sqrt(np.mean((np.array(q) - log.q) ** 2)))


def test_mujocos_own_motors_come_to_the_averaged_drive_as_their_step_falls(run):
    """Their current is half a step late: 0.5 mrad of difference at a step of half the loop's 1 / w, none at h = 0."""
    errors = [off(run, h) for h in (8e-5, 4e-5, 2e-5)]
    for wide, narrow in pairwise(errors):
        assert 1.9 < wide / narrow < 2.1  # of first order; the next is some h w = 0.05 of it
    assert abs(2 * errors[2] - errors[1]) < 0.02 * errors[1]  # nothing is left of them at h = 0
