"""Torques with the other sign, and one that was not logged, on two links: whose residuals may not show it."""

import re
from dataclasses import replace

import numpy as np
import pytest

from idbench.identify.files.log_file import write_log
from idbench.sim.engine.run import ideal_log
from idbench.sim.robot.robot import Robot
from idbench.sim.trajectories import RandomMoves


@pytest.fixture(scope="module")
def log():
    robot = Robot.load("two_link")
    found = ideal_log(robot, RandomMoves(moves=14, durations=(0.6, 1.2), velocity=(4.0,), rest=0.1).sample(robot, 200.0))
    noise = 0.002 * found.tau.std(axis=0) * np.random.default_rng(2).standard_normal(found.tau.shape)
    return replace(found, tau=found.tau + noise)


@pytest.mark.parametrize(
    "signs", [(1, 1), (1, -1), *(pytest.param(x, marks=pytest.mark.thorough) for x in ((-1, 1), (-1, -1)))]
)
def test_a_torque_with_the_other_sign_is_no_fair_result(log, signs, tmp_path, ran):
    write_log(replace(log, tau=log.tau * signs), tmp_path / "log.csv")
    first, *then = ran("identify log.csv --robot two_link --torque instantaneous").out.splitlines()[:3]
    assert first.startswith("Result: good: torques within" if min(signs) > 0 else "Result: poor")
    assert (f"next: --gain {signs[0]} {signs[1]}" in then) == (min(signs) < 0)


@pytest.mark.parametrize("delay", ["estimate", "joints", "0"])
def test_a_torque_that_was_not_logged_hides_what_only_it_shows(log, delay, tmp_path, ran):
    """Also where the delay is sought; no advice is to move the joint more."""
    write_log(log, tmp_path / "log.csv")
    lines = (tmp_path / "log.csv").read_text().splitlines()
    kept = [",".join(line.split(",")[:-1]) for line in lines if not line.startswith("#")]
    (tmp_path / "one.csv").write_text("\n".join(kept) + "\n")
    printed = ran(f"identify one.csv --robot two_link --torque instantaneous --torque-delay {delay} --no-trials").out
    assert re.search(r"without the torque of elbow, .*Ia2, Fv2, Fs2 are not shown", printed)
    assert "move elbow" not in printed


def test_a_wrong_delay_is_no_sign(tmp_path, ran):
    """Of a light joint with much friction: the delay takes Fv times itself from its inertia, its friction stays positive."""
    robot = """<mujoco><option gravity="0 0 0"/><worldbody><body><joint name="a" axis="0 0 1" damping="0.5" frictionloss="0.4"/>
      <geom type="capsule" fromto="0 0 0 .3 0 0" size=".03" mass="2"/><body pos=".3 0 0">
      <joint name="b" axis="0 0 1" damping="0.3" frictionloss="0.3" armature="0.0005"/>
      <geom type="capsule" fromto="0 0 0 .08 0 0" size=".01" mass=".05"/></body></body></worldbody></mujoco>"""
    (tmp_path / "arm.xml").write_text(robot)
    arm = Robot.load(str(tmp_path / "arm.xml"))
    moves = RandomMoves(moves=14, durations=(0.6, 1.2), velocity=(4.0,), rest=0.1).sample(arm, 200.0)
    found = ideal_log(arm, moves)
    noise = 0.002 * found.tau.std(axis=0) * np.random.default_rng(3).standard_normal(found.tau.shape)
    early = replace(found, q=found.q[2:], tau=(found.tau + noise)[:-2], torque=found.torque)
    write_log(early, tmp_path / "log.csv")
    out = ran("identify log.csv --robot arm.xml --torque instantaneous --torque-delay 0 --no-trials").out
    first, then = out.splitlines()[:2]
    assert "other sign" not in first
    assert "--gain" not in then
