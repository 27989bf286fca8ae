"""`idbench servo`: from logs of commands and positions to servos of MuJoCo, of arms whose servos MuJoCo simulates."""

import importlib.util
import json
import os
import re
import shlex
import subprocess
import sys
from dataclasses import replace
from importlib.metadata import files
from pathlib import Path

import mujoco
import numpy as np
import pytest
from builders import pendulum

from idbench.experiments.cli import main
from idbench.experiments.recording.folder import known
from idbench.identify.files.servo_file import ServoFile
from idbench.identify.servo import ServoRun
from idbench.identify.servo.closed_loop import ServoLoop
from idbench.identify.servo.parameters import SERVO_PARAMETERS
from idbench.sim.robot.robot import Robot
from idbench.sim.robot.servos import STEP, Commands, ServoValues, replay, with_servos
from idbench.sim.scenario.scenario_file import load, to_toml

KP, GAIN, SUPPLY, LIMIT, COUNT = 16.0, 0.166, 12.0, 0.97, 2 * np.pi / 4096

PENDULUM = """
<mujoco model="pendulum"><worldbody><body name="arm"><joint name="axis" axis="0 -1 0" armature="0.5" damping="3"/>
<inertial pos="0 0 -0.12" mass="0.6" diaginertia="1e-5 1e-5 1e-5"/></body></worldbody></mujoco>
"""
TRUTH = ServoValues(0.55, 1.2, GAIN * KP, SUPPLY, LIMIT, 0.02, 0.0, 0.1, 4.5, 0.02)


def commands(seconds: float, n: int, seed: int, size: float = 1.1) -> tuple[np.ndarray, np.ndarray]:
    """Return times and steps with waves of each joint."""
    rng, t = np.random.default_rng(seed), np.arange(0, seconds, 0.01)
    joints = []
    for j in range(n):
        steps = rng.uniform(-size, size, 60)[np.minimum((t / (0.55 + 0.07 * j)).astype(int), 59)]
        joints.append(steps + 0.3 * np.sin(2 * np.pi * rng.uniform(0.5, 1.5) * t))
    return t, np.stack(joints, axis=1)


def write(path: Path, t: np.ndarray, q: np.ndarray, command: np.ndarray, names: list[str]) -> None:
    counted = np.round(q / COUNT) * COUNT
    header = ",".join(["t", *(f"q_{name}" for name in names), *(f"command_{name}" for name in names)])
    np.savetxt(path, np.c_[t, counted, command], delimiter=",", header=header, comments="")


@pytest.fixture(scope="module")
def bench(tmp_path_factory):
    """Return a folder with a pendulum, what is known of its servo, and two logs."""
    folder = tmp_path_factory.mktemp("servo")
    robot = folder / "pendulum.xml"
    robot.write_text(PENDULUM)
    (folder / "servo.toml").write_text(f'model = "STS3215"\nkp = {KP}\nsupply = {SUPPLY}\n')
    text = with_servos(str(robot), {0: TRUTH}, folder)
    for seed, name in enumerate(("fit", "new")):
        t, u = commands(6.0, 1, seed)
        write(folder / f"{name}.csv", t, replay(str(robot), text, folder, Commands(t, u, [0]), u[0]), u, ["axis"])
    return folder


def words(bench, *more):
    return ["servo", bench / "fit.csv", "--robot", bench / "pendulum.xml", "--servo", bench / "servo.toml", *more]


def test_servo_of_a_bench_is_found_and_written(bench, idbench):
    more = ("--friction", "coulomb", "--validate", bench / "new.csv", "--write", "out.xml", "--out", "results")
    code, out, err = idbench(*words(bench, *more))
    assert code == 0, err
    assert "torque is never off" in out
    summary = json.loads(Path("results/summary.json").read_text())
    found = {name: entry["value"] for name, entry in summary["joints"]["axis"].items()}
    # MuJoCo's friction holds softly near rest, and its implicit damping makes the inertia b STEP larger
    inertia = 0.02 + TRUTH.b * STEP
    for name, true, share in (
        ("a", 0.55, 0.02),
        ("b", 1.2, 0.02),
        ("Ia", inertia, 0.04),
        ("rate", 4.5, 0.01),
        ("Fs", 0.1, 0.2),
    ):
        assert abs(found[name] - true) < share * true, (name, found[name])
    assert abs(found["delay"] - TRUTH.delay) < STEP
    # plain MuJoCo follows the held-out log to a count or two
    assert summary["mujoco_error"]["new.csv"]["axis"] < 2 * COUNT
    model = mujoco.MjModel.from_xml_path("out.xml")
    assert model.dof_armature[0] == found["Ia"]
    assert model.nu == 1
    assert out.startswith("Result: good (axis): positions off by")
    report = Path("results/report.html").read_text()
    assert "Result: good (axis): positions off by" in report
    assert "Positions: new.csv" in report
    assert {"servo/axis/q/measured", "servo/axis/q/simulated", "servo/axis/residual"} <= known([Path("results/recording.rrd")])[
        1
    ]


def test_the_python_function_moves_as_the_fit_does(bench, idbench):
    """Stepped by hand, with friction as the file's first lines say: the fit's own positions to a count."""
    code, _, err = idbench(*words(bench, "--friction", "load", "--write", "found.py", "--out", "results"))
    assert code == 0, err
    spec = importlib.util.spec_from_file_location("found", "found.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    p, h, g = module.SERVOS["axis"], 5e-4, 9.81
    t, u = np.loadtxt(bench / "fit.csv", delimiter=",", skiprows=1, unpack=True)[[0, 2]]
    m, x = 0.6, 0.12
    servo, q, qd, path = module.Servo("axis", h), p["offset"], 0.0, []
    for k in range(round(3.0 / h)):
        if k % round(0.01 / h) == 0:
            path.append(q - p["offset"])
        motor = servo.torque(u[min(round(k * h / 0.01 - 0.499), len(u) - 1)] + p["offset"], q, qd)
        external, J = -m * g * x * np.sin(q), m * x**2 + p["Ia"]
        most = h / J * servo.friction(qd, motor, external)
        free = qd + h / J * (motor + external - p["Fv"] * qd)
        qd = free - min(max(free, -most), most)
        q += h * qd
    stated = ServoFile.read(bench / "servo.toml").servo("axis", "")
    run = ServoRun(t, 0 * t, u, pendulum(m, x), stated)
    of_file = {name: value for name, value in p.items() if name in SERVO_PARAMETERS}
    expected = ServoLoop([run], h).simulate(of_file)[0, 0]
    assert np.abs(np.array(path) - expected[: len(path)]).mean() < 2 * COUNT


@pytest.mark.thorough
def test_joints_that_are_done_are_kept_when_the_others_are_interrupted(tmp_path, monkeypatch, capfd):
    monkeypatch.chdir(tmp_path)
    arm = load("servo-arm")
    Path("short.toml").write_text(to_toml(replace(arm, trajectory=replace(arm.trajectory, steps=24))))
    assert main(["run", "short.toml", "--out", "run", "--no-rerun"]) == 0
    from idbench.experiments.servo import identification

    real, calls = identification.identify_servo, []

    def identify(*args):
        calls.append(args)
        if len(calls) > 1:
            raise KeyboardInterrupt
        return real(*args)

    monkeypatch.setattr(identification, "identify_servo", identify)
    words = ["servo", "run/log.parquet", "--robot", "servo_arm", "--servo", "run/servo.toml", "--friction", "coulomb"]
    assert main([*words, "--out", "found"]) != 0
    assert "base_yaw" in capfd.readouterr().out
    assert set(json.loads(Path("found/summary.json").read_text())["joints"]) == {"base_yaw"}


@pytest.mark.thorough
def test_the_page_takes_an_arm_to_a_model(root, tmp_path, monkeypatch, capfd):
    """Every command of the page, but for viewers, and for all laws of six joints, which take minutes."""
    monkeypatch.chdir(tmp_path)
    blocks = re.findall(r"```sh\n(.*?)```", (root / "docs" / "servo.md").read_text(), re.DOTALL)
    for block in blocks:
        if not block.startswith("uv run") or "sed" in block:
            commands = block.replace(
                "uv run idbench", f"{sys.executable} -c 'from idbench.experiments.cli import entry; entry()'"
            )
            subprocess.run(
                ["bash", "-euc", commands], check=True, env=os.environ | {"PYTHONPATH": str(root)}, capture_output=True
            )
            continue
        for line in block.splitlines():
            if not any(word in line for word in (" view ", "mujoco.viewer", "--friction auto")):
                assert main(shlex.split(line.removeprefix("uv run idbench "))) == 0, line
    assert "of the motion on other logs" in capfd.readouterr().out
    summary = json.loads(Path("runs/servos/summary.json").read_text())
    errors = summary["mujoco_error"]["log.parquet"]
    assert set(errors) == set(summary["joints"])
    scaled = [joint for joint, of in summary["joints"].items() if "factor" not in of["a"]]
    assert {"base_yaw", "shoulder", "elbow", "wrist_pitch"} <= set(scaled)
    assert max(errors[joint] for joint in scaled) < 3 * COUNT
    for joint in ("shoulder", "elbow"):
        assert summary["joints"][joint]["a"]["value"] == pytest.approx(2.05 / 3.33, rel=0.01)


@pytest.mark.thorough
def test_estimates_are_printed_and_saved_whatever_ends_the_verdict(bench, idbench, tmp_path, monkeypatch):
    monkeypatch.setattr("idbench.experiments.servo.job.ServosFit.summary", lambda _: 1 / 0)
    code, out, _ = idbench(*words(bench, "--friction", "coulomb", "--out", tmp_path / "kept"))
    assert code == 1
    assert "Ia [kg m^2]" in out
    assert json.loads((tmp_path / "kept" / "summary.json").read_text())["joints"]["axis"]["a"]["value"] > 0


def test_position_actuators_compile(bench, tmp_path):
    text = with_servos(str(bench / "pendulum.xml"), {0: TRUTH}, tmp_path, position=True)
    model = mujoco.MjModel.from_xml_string(text)
    assert model.actuator_forcerange[0, 1] == pytest.approx(TRUTH.a * SUPPLY * LIMIT)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ('gain = 0.166\ngain_unit = "1/grad"', "gain_unit"),
        ('model = "STS3251"', "STS3215"),
        ("kpp = 4", "did you mean 'kp'"),
        ("kp = 4", "gain is missing"),
        ("gain = -1", "above 0"),
        ('gain = "much"', "must be a number"),
        ("gain = ", "servo.toml"),
    ],
)
def test_wrong_servo_files_are_refused(bench, tmp_path, complaint, text, expected):
    path = tmp_path / "servo.toml"
    path.write_text(text)
    args = ["servo", str(bench / "fit.csv"), "--robot", str(bench / "pendulum.xml"), "--servo", str(path)]
    assert expected in complaint(*args)


@pytest.mark.parametrize(
    ("more", "expected"),
    [
        (["--friction", "sticky"], "directional"),
        (["--find", "gap"], "no parameter"),
        (["--find", "Fle"], "friction load has no parameter"),
        (["--hold", "Fgd=0.1"], "friction load has no parameter"),
        (["--hold", "a=0"], "impossible"),
        (["--friction", "auto", "--hold", "Fx=1"], "no parameter 'Fx'"),
        (["--friction", "auto", "--find", "Fl"], "no parameter 'Fl'"),
        (["--hold", "rate=nan"], "impossible"),
        (["--hold", "a"], "give letters and numbers"),
        (["--hold", "a=much"], "letters and numbers"),
        (["--units", "command=grad"], "unit 'grad'"),
        (["--units", "q=deg"], "is the command in degrees"),
        (["--columns", "command=goal"], "--columns command=NAME"),
        (["--columns", "torque=goal"], "give t="),
        (["--write", "out.txt"], "must end with .xml"),
    ],
)
def test_wrong_options_are_refused(bench, complaint, more, expected):
    assert expected in complaint(*[str(word) for word in words(bench, *more)])


def test_a_joint_that_slides_is_refused(bench, tmp_path, complaint):
    path = tmp_path / "slide.xml"
    path.write_text(PENDULUM.replace('name="axis"', 'name="axis" type="slide"'))
    args = ["servo", str(bench / "fit.csv"), "--robot", str(path), "--servo", str(bench / "servo.toml")]
    assert "axis slides" in complaint(*args)


def test_missing_files_are_named(bench, complaint):
    assert "--servo is missing" in complaint("servo", str(bench / "fit.csv"), "--robot", str(bench / "pendulum.xml"))
    assert "nowhere.csv" in complaint(*[str(word) for word in words(bench)], str(bench / "nowhere.csv"))


def test_missing_values_are_named(bench, tmp_path, complaint):
    lines = (bench / "fit.csv").read_text().splitlines()
    lines[40] = lines[40].split(",")[0] + ",nan,0.1"
    path = tmp_path / "holes.csv"
    path.write_text("\n".join(lines))
    said = complaint("servo", str(path), *[str(word) for word in words(bench)[2:]])
    assert "q is missing at sample 39" in said


def so101() -> str:
    (path,) = [f.locate() for f in files("example-robot-data") or () if str(f).endswith("so101.urdf")]
    return str(path)


@pytest.mark.thorough
def test_servos_of_an_arm_are_found_in_place(tmp_path, monkeypatch):
    """The SO-101: joints that carry a load are found, torques of those that do not are known up to a factor."""
    urdf = so101()
    robot = Robot.load(urdf)
    servos = {
        j: ServoValues(0.5 + 0.05 * j, 1.1 + 0.05 * j, GAIN * KP, SUPPLY, LIMIT, 0.02, 0.0, 0.06, 4.8, 0.015)
        for j in range(robot.n)
    }
    t, u = commands(12.0, robot.n, 5, 0.7)
    u += robot.ranges.mean(axis=1)
    text = with_servos(urdf, servos, tmp_path)
    write(tmp_path / "log.csv", t, replay(urdf, text, tmp_path, Commands(t, u, range(robot.n)), u[0]), u, list(robot.joints))
    (tmp_path / "servo.toml").write_text(f'model = "STS3215"\nkp = {KP}\nsupply = {SUPPLY}\n')
    monkeypatch.chdir(tmp_path)
    args = ["servo", "log.csv", "--robot", urdf, "--servo", "servo.toml", "--friction", "coulomb", "--out", "results"]
    assert main(args) == 0
    summary = json.loads(Path("results/summary.json").read_text())
    assert "factor" in summary["joints"]["wrist_roll"]["a"]  # its axis carries no load, and its link nothing worth weighing
    for joint in ("shoulder_lift", "elbow_flex"):
        found, true = summary["joints"][joint], servos[robot.joints.index(joint)]
        for name, value in (("a", true.a), ("b", true.b), ("Ia", true.armature), ("rate", true.rate)):
            assert abs(found[name]["value"] - value) < 0.05 * value, (joint, name)


@pytest.mark.thorough
@pytest.mark.parametrize(("degrees", "seed"), [(0.5, 1), (1.0, 2)])
def test_backlash_of_a_simulated_servo_is_found(idbench, tmp_path, degrees, seed):
    """From a simulated log, with sampling jitter and torque that is off once, to the free play: within 10 %."""
    scenario = load("servo-backlash")
    play, trajectory = np.deg2rad(degrees), replace(scenario.trajectory, seed=seed)
    changed = replace(scenario, seed=seed, trajectory=trajectory, drive=replace(scenario.drive, backlash=(play,)))
    (tmp_path / "servo.toml").write_text(to_toml(changed))
    assert main(["run", str(tmp_path / "servo.toml"), "--out", str(tmp_path / "run"), "--no-rerun"]) == 0
    log, stated = tmp_path / "run" / "log.parquet", tmp_path / "run" / "servo.toml"
    find = ["--friction", "coulomb", "--find", "backlash"]
    files = ["--write", str(tmp_path / "play.xml"), "--out", str(tmp_path / "found")]
    assert main(["servo", str(log), "--robot", "pendulum", "--servo", str(stated), *find, *files]) == 0
    joint = json.loads((tmp_path / "found" / "summary.json").read_text())["joints"]["swing"]
    assert joint["backlash"]["value"] == pytest.approx(play, rel=0.1)
    assert joint["a"]["value"] == pytest.approx(2.05 / 3.33, rel=0.01)
    assert joint["Ia"]["value"] == pytest.approx(0.02, rel=0.02)
    model = mujoco.MjModel.from_xml_path(str(tmp_path / "play.xml"))
    assert np.ptp(model.joint("swing_play").range) == pytest.approx(joint["backlash"]["value"])
    # the loop of the file sees the rotor, which is within half the play
    summary = json.loads((tmp_path / "found" / "summary.json").read_text())
    assert summary["mujoco_error"]["log.parquet"]["swing"] < play


@pytest.mark.thorough
def test_logs_may_be_of_other_loads(bench, idbench, tmp_path):
    """A heavier arm in one log: named, both logs have one servo; not named, no scale fits both."""
    heavy = PENDULUM.replace('mass="0.6"', 'mass="1.2"')
    (tmp_path / "heavy.xml").write_text(heavy)
    text = with_servos(str(tmp_path / "heavy.xml"), {0: TRUTH}, tmp_path)
    t, u = commands(6.0, 1, 5)
    write(
        tmp_path / "heavy-5.csv", t, replay(str(tmp_path / "heavy.xml"), text, tmp_path, Commands(t, u, [0]), u[0]), u, ["axis"]
    )
    plain = (bench / "servo.toml").read_text()
    (tmp_path / "servo.toml").write_text(f'{plain}[logs."heavy*"]\nrobot = "heavy.xml"\n')
    logs = ["servo", bench / "fit.csv", tmp_path / "heavy-5.csv", "--robot", bench / "pendulum.xml", "--friction", "coulomb"]
    more = ["--servo", tmp_path / "servo.toml", "--validate", tmp_path / "heavy-5.csv", bench / "new.csv", "--json"]
    code, out, err = idbench(*logs, *more, "--write", "out.xml", "--out", "named")
    assert code == 0, err
    found = json.loads(out)
    p = {name: entry["value"] for name, entry in found["joints"]["axis"].items()}
    assert (p["a"], p["b"]) == pytest.approx((TRUTH.a, TRUTH.b), rel=0.02)
    assert max(found["position_error"]["held out"]["axis"]) < 2 * COUNT
    assert list(found["mujoco_error"]) == ["heavy-5.csv", "new.csv"]
    assert max(error["axis"] for error in found["mujoco_error"].values()) < 3 * COUNT
    more[1] = bench / "servo.toml"
    code, out, err = idbench(*logs, *more, "--out", "unnamed")
    assert code == 0, err
    unnamed = json.loads(out)
    assert "factor" in unnamed["joints"]["axis"]["a"] or not unnamed["verdict"][0].startswith("axis: good")


@pytest.mark.parametrize(
    ("robot", "said"),
    [("'other.xml'", "the joints of"), ("3", "robot = 3 must be the name of a robot"), ("'none.xml'", "none.xml")],
)
def test_the_robot_of_a_log_has_the_same_joints(bench, idbench, tmp_path, robot, said):
    (tmp_path / "other.xml").write_text(PENDULUM.replace('name="axis"', 'name="wheel"'))
    (tmp_path / "servo.toml").write_text(f'{(bench / "servo.toml").read_text()}[logs."f*"]\nrobot = {robot}\n')
    code, _, err = idbench("servo", bench / "fit.csv", "--robot", bench / "pendulum.xml", "--servo", tmp_path / "servo.toml")
    assert code != 0
    assert said in err
