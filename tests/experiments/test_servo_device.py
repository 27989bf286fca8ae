"""Servos that ship, identified from public logs."""

import json
from types import SimpleNamespace

import mujoco
import numpy as np
import pytest

from idbench.experiments.cli import main
from idbench.experiments.errors import ExperimentError
from idbench.experiments.servo.servo_files import bam_of, device_of, devices, servo_function
from idbench.identify.files.servo_file import ServoFile
from idbench.identify.servo import Servo


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


LAWS = {
    "coulomb": {},
    "stribeck": {"Fst": 0.2, "vs": 0.3},
    "load": {"Fl": 0.15},
    "load-stribeck": {"Fst": 0.2, "vs": 0.3, "Fl": 0.15, "Fls": 0.05},
    "directional": {"Fst": 0.2, "vs": 0.3, "Fle": 0.1, "Flm": 0.2},
}


def budget(bam, motor, external, speed):
    """Friction of BAM's models M1 to M5 (arXiv 2410.08650, section III), by the names of their files."""
    near = np.exp(-((abs(speed) / bam["dtheta_stribeck"]) ** bam["alpha"])) if bam["model"] not in ("m1", "m3") else 0.0
    if bam["model"] == "m5":
        load = abs(bam["load_friction_external"] * external - bam["load_friction_motor"] * motor)
        more = abs(bam["load_friction_external_stribeck"] * external - bam["load_friction_motor_stribeck"] * motor)
    else:
        load, more = (bam[x] * abs(external - motor) for x in ("load_friction_base", "load_friction_stribeck"))
    return bam["friction_base"] + load + near * (bam["friction_stribeck"] + more)


@pytest.mark.parametrize("law", LAWS)
def test_a_file_of_bam_has_the_same_friction(law, rng):
    servo = Servo(gain=0.166, kp=16.0, supply=12.0, limit=0.97, counts=4096)
    p = {"a": 0.57, "b": 1.18, "Ia": 0.022, "Fs": 0.12, "Fv": 0.02, "offset": 0.0, "delay": 0.02, "rate": 4.8, **LAWS[law]}
    fit = SimpleNamespace(friction=law, servo=servo, p=p)
    text, lost = bam_of(fit, "STS3215")
    assert lost == []
    bam, space = json.loads(text), {}
    assert bam["actuator"] == "sts3215"
    assert (bam["kt"] / bam["R"], bam["kt"] ** 2 / bam["R"]) == pytest.approx((0.57, 1.18))
    exec(servo_function("arm", {"axis": (servo, fit)}, ["a.csv"]), space)
    ours = space["Servo"]("axis", 0.001)
    for motor, external, speed in rng.normal(size=(50, 3)):
        assert ours.friction(speed, motor, external) == pytest.approx(budget(bam, motor, external, speed))


def test_what_bam_has_no_place_for_is_said_or_refused():
    p = {"a": 0.57, "b": 1.18, "Ia": 0.022, "Fs": 0.12, "Fv": 0.02, "offset": 0.0, "delay": 0.02, "lag": 0.03}
    servo = Servo(gain=0.166, kp=16.0, supply=12.0, limit=0.97)
    assert bam_of(SimpleNamespace(friction="coulomb", servo=servo, p=p), "MX-64")[1] == ["lag"]
    for friction, loop, model in (("gear", servo, "MX-64"), ("coulomb", servo, ""), ("coulomb", Servo(kind="torque"), "MX-64")):
        with pytest.raises(ExperimentError, match="BAM has DC motors, of a model"):
            bam_of(SimpleNamespace(friction=friction, servo=loop, p=p), model)
