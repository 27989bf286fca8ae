"""What is wrong with robots and their logs, in one line each."""

import re

import numpy as np
import pytest

from idbench.identify import MotionLog
from idbench.identify.files.log_file import read_log, write_log


@pytest.mark.thorough
def test_a_log_in_degrees_is_pointed_out(idbench, changed):
    path = changed(q=np.rad2deg)
    _, out, err = idbench("identify", path, "--robot", "puma560", "--model", "explicit")
    assert "are positions logged in degrees? Then add --units q=deg" in out + err


@pytest.mark.thorough
def test_positions_out_of_range_are_pointed_out(idbench, changed):
    path = changed(q=lambda q: q + 10)
    _, out, err = idbench("identify", path, "--robot", "puma560", "--model", "explicit")
    assert "out of its range" in out + err
    assert "are joints in the order of the robot's file, and counted from its zero in its direction?" in out + err


@pytest.mark.thorough
def test_torques_of_the_wrong_sign_are_pointed_out(idbench, changed):
    code, out, _ = idbench("identify", changed(tau=np.negative), "--robot", "puma560", "--model", "explicit")
    assert code == 0
    assert "friction drives joint1, joint2, joint3, joint4, joint5, joint6 in the explicit model" in out
    assert "the torques of the log take out" in out
    code, out, _ = idbench(
        "identify", changed(tau=lambda tau: tau * [1, 1, 1, 1, 1, -1]), "--robot", "puma560", "--model", "explicit"
    )
    assert "friction drives joint6 in the explicit model: does the torque have the wrong sign" in out


@pytest.mark.thorough
def test_a_joint_that_stands_is_told_with_the_move_that_helps(idbench, changed):
    def hold(x):
        return np.where(np.arange(6) == 5, 0.0, x)

    code, out, err = idbench("identify", changed(q=hold), "--robot", "puma560", "--model", "explicit")
    assert code == 0, err
    assert "this log does not excite" in out
    assert "left out, as if zero (joint6 never moves in this log: move it)" in out
    assert "Fv5  " in out
    assert "Fv6  " not in out


@pytest.mark.parametrize("extra", ['<joint name="[red]a" stiffness="5"/>', '<joint name="a[/x]" stiffness="5"/>'])
def test_names_are_printed_as_they_are_and_springs_are_parameters(idbench, tmp_path, extra):
    site = '<actuator><motor site="s" gear="1 0 0 0 0 0" forcerange="-1 1"/></actuator>'
    (tmp_path / "r.xml").write_text(
        f'<mujoco><worldbody><body>{extra}<geom size="0.1"/><site name="s"/></body></worldbody>{site}</mujoco>'
    )
    code, out, err = idbench("robot", "r.xml")
    assert code == 0, err
    assert extra.split('"')[1] in out
    assert re.search(r"\bK1\b", out)
    code, _, err = idbench("robot", "r.xml", "--without", "XXR1" if "XXR1" in out else "XX1", "Fv1", "Fs1", "MX1", "MY1")
    assert code == 2


@pytest.mark.thorough
def test_a_slide_in_millimetres_is_pointed_out(idbench, tmp_path, arm):
    code, _, err = idbench("run", "second.toml", "--robot", "arm.xml", "--out", "run", "--no-rerun")
    assert code == 0, err
    log = read_log(tmp_path / "run" / "log.parquet")
    write_log(MotionLog(log.fs, log.q * [1, 1000], log.tau, log.torque), tmp_path / "mm.parquet")
    _, out, err = idbench("identify", "mm.parquet", "--robot", "arm.xml", "--model", "explicit")
    assert "are positions logged in millimetres? Then add --units q=mm" in out + err
