"""Servos that ship, identified from public logs."""

import json

import mujoco
import numpy as np
import pytest

from idbench.experiments.cli import main
from idbench.experiments.servo.servo_files import device_of, devices
from idbench.identify.files.servo_file import ServoFile


@pytest.mark.parametrize("name", devices())
def test_a_device_has_standard_errors_and_a_covariance(name):
    known = device_of(name)
    C, sigma = np.array(known["covariance"]), known["parameters"]
    assert np.linalg.eigvalsh(C).min() > -1e-12 * np.linalg.eigvalsh(C).max()
    for k, letter in enumerate(known["free"]):
        if letter in sigma:
            assert sigma[letter]["sigma"] == pytest.approx(np.sqrt(C[k, k]))
            assert sigma[letter]["sigma"] < 0.5 * abs(sigma[letter]["value"])
    assert known["units"] >= 1
    assert 0 < known["held_out_error"] < 0.05


def test_the_rate_limit_is_the_speed_of_the_datasheet():
    """45 rpm at 12 V, stated in two digits: to 5 %."""
    rate = device_of("STS3215")["parameters"]["rate"]["value"]
    assert rate == pytest.approx(45 * 2 * np.pi / 60, rel=0.05)


def test_files_of_a_device_are_read(idbench, tmp_path):
    code, out, err = idbench("device", "STS3215", "--write", tmp_path / "arm.xml", tmp_path / "servo.toml",
                             "--robot", "servo_arm", "--joints", "elbow", "shoulder", "--kp", "32")  # fmt: skip
    assert code == 0, err
    assert "one unit was logged" in out
    model = mujoco.MjModel.from_xml_path(str(tmp_path / "arm.xml"))
    assert {model.actuator(k).name for k in range(model.nu)} >= {"elbow_servo", "shoulder_servo"}
    assert model.joint("elbow").armature[0] == pytest.approx(device_of("STS3215")["parameters"]["Ia"]["value"], rel=1e-4)
    servo = ServoFile.read(tmp_path / "servo.toml").servo("elbow", "log.csv")
    assert (servo.gain, servo.limit, servo.counts) == (0.166, 0.97, 4096)
    code, out, _ = idbench("device", "STS3215", "--json")
    assert json.loads(out)["covariance"]


def test_devices_are_listed(capsys):
    assert main(["device"]) == 0
    assert "STS3215: GitHub kscalelabs/sysid" in capsys.readouterr().out
