"""Servos that ship, identified from public logs."""

import json
from types import SimpleNamespace
from xml.etree import ElementTree

import mujoco
import numpy as np
import pytest

from idbench.experiments.cli import main
from idbench.experiments.errors import ExperimentError
from idbench.experiments.servo.bam import bam_of
from idbench.experiments.servo.servo_files import device_of, devices, servo_function
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


MX64 = {"kt": 1.6, "R": 3.4, "armature": 0.012, "friction_base": 0.04, "friction_stribeck": 0.03, "load_friction_motor": 0.1,
        "load_friction_external": 0.05, "load_friction_motor_stribeck": 0.0, "load_friction_external_stribeck": 0.15,
        "dtheta_stribeck": 0.4, "alpha": 1.5, "friction_viscous": 0.03, "model": "m5", "actuator": "mx64"}  # fmt: skip
"""What BAM's files of an M5 have, and no more: neither a delay nor a rate limit."""


def bam_file(folder, **other):
    """Return the path of such a file, with other values; None leaves a key out."""
    path = folder / "m5.json"
    path.write_text(json.dumps({key: x for key, x in (MX64 | other).items() if x is not None}))
    return path


def test_what_is_written_for_bam_is_read_back(tmp_path):
    servo = Servo(gain=0.166, kp=16.0, supply=12.0, limit=0.97, counts=4096)
    p = {
        "a": 0.57,
        "b": 1.18,
        "Ia": 0.022,
        "Fs": 0.12,
        "Fv": 0.02,
        "offset": 0.1,
        "delay": 0.02,
        "rate": 4.8,
        "gain_error": 0.1,
    }
    known = {letter: x for letter, x in p.items() if letter not in ("offset", "gain_error")}
    for law, more in LAWS.items():
        path = tmp_path / "servo.json"
        path.write_text(bam_of(SimpleNamespace(friction=law, servo=servo, p=p | more), "MX-64")[0])
        read = device_of(str(path))
        values = {letter: of["value"] for letter, of in read["parameters"].items()}
        assert values == pytest.approx({**known, **more})
        assert read["friction"] == law
        assert read["beyond"] == {}
        assert read["known"] == {"model": "MX-64", "gain": pytest.approx(1.1 * 0.158)}


@pytest.mark.parametrize("model", ["m1", "m2", "m3", "m4", "m5", "m6"])
def test_a_published_file_of_bam_becomes_a_dcmotor(idbench, tmp_path, model):
    """Its motor: V = error_gain ratio kp vin (u - q), tau = kt (V - kt qd) / R, as BAM has it."""
    given = {
        "error_gain_ratio": 1.16,
        "load_friction_base": 0.1,
        "load_friction_stribeck": 0.1,
        "load_friction_motor_quad": 0.01,
    }
    path = bam_file(tmp_path, model=model, **given)
    made = tmp_path / "arm.xml", tmp_path / "servo.toml"
    code, out, err = idbench("device", path, "--supply", 12, "--kp", 32, "--write", *made)
    assert code == 0, err
    assert "load_friction_motor_quad = 0.01 has no place" in out
    mj = mujoco.MjModel.from_xml_path(str(made[0]))
    axis = mj.actuator("swing_servo").trnid[0]
    motor = ElementTree.parse(made[0]).find(".//dcmotor").attrib
    kp, *_, most = map(float, motor["controller"].split())
    assert (float(motor["motorconst"]), float(motor["resistance"])) == pytest.approx((1.6, 3.4))
    assert kp * 3.4 / 1.6 == pytest.approx(1.16 * 0.158 * 32 * 12)  # V = (R/K) kp (u - q)
    assert most == pytest.approx(0.9625 * 12)
    assert mj.dof_armature[axis] == pytest.approx(0.012)
    assert mj.dof_frictionloss[axis] == pytest.approx(0.04)
    servo = ServoFile.read(made[1]).servo("swing", "log.csv")
    assert (servo.gain, servo.kp, servo.supply) == (pytest.approx(1.16 * 0.158), 32, 12)


@pytest.mark.parametrize(
    ("other", "message"),
    [
        ({"R": None}, "of a motor with kt, R, armature"),
        ({"kt": 0.0}, "kt = 0.0 must be a finite number above 0"),
        ({"kt": 10**400}, "int too large to convert to float"),
        ({"model": "m9"}, "model must be one of m1, m2, m3, m4, m5, m6"),
        ({"friction_base": -0.1}, "friction_base = -0.1 must be a finite number, 0 or above"),
        ({"load_friction_motor_stribeck": float("nan")}, "load_friction_motor_stribeck = nan must be a finite number"),
        ({"command_delay": 3600.0}, "command_delay = 3600 s is longer than 1 s"),
        ({"max_velocity": 0.0}, "max_velocity = 0.0 must be a finite number above 0"),
        ({"error_gain_ratio": "1.2 V"}, "could not convert string to float: '1.2 V'"),
        ({"alpha": "steep"}, "could not convert string to float: 'steep'"),
        ({"error_gain_ratio": 0.0}, "error_gain_ratio = 0.0 must be a finite number above 0"),
        ({"armature": "heavy"}, "could not convert string to float: 'heavy'"),
        ({}, "BAM does not write the supply: add --supply"),
        ({"actuator": "erob80_50"}, "the gain of this actuator is not known; those of STS3215"),
    ],
)
def test_a_wrong_file_of_bam_is_named(idbench, tmp_path, other, message):
    code, _, err = idbench("device", bam_file(tmp_path, **other), "--write", tmp_path / "arm.xml")
    assert code == 2
    assert message in " ".join(err.split())
    assert not (tmp_path / "arm.xml").exists()
