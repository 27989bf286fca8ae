"""Any robot from the command line, as a user asks, and what is wrong with robots and logs, in one line each."""

import json
from dataclasses import replace

import numpy as np
import pytest

from experiments.cli import main
from identify import MotionLog
from identify.log_file import write_log
from sim.engine import simulate
from sim.robot import Robot
from sim.scenario_file import load, to_toml
from sim.tree import standard_parameters


@pytest.fixture(scope="module")
def logs(tmp_path_factory):
    """Return a folder with two logs of the PUMA, short ones."""
    folder, arm = tmp_path_factory.mktemp("logs"), load("arm")
    for name, moves, seed in (("first", 12, 0), ("second", 5, 3)):
        trajectory = replace(arm.trajectory, moves=moves, seed=seed)
        log = simulate(replace(arm, robot="puma560", fs=250.0, trajectory=trajectory)).alone()
        write_log(log, folder / f"{name}.parquet")
    return folder


@pytest.fixture
def told(capsys, monkeypatch, tmp_path):
    """Run a command in an empty folder; return its code, what it printed, and its complaint."""
    monkeypatch.chdir(tmp_path)

    def run(*words):
        code = main([str(word) for word in words])
        out, err = capsys.readouterr()
        return code, out, err

    return run


@pytest.fixture
def changed(logs, tmp_path):
    """Write the first log with positions and torques changed."""

    def write(q=lambda q: q, tau=lambda tau: tau, name="changed.parquet"):
        from identify.log_file import read_log

        log = read_log(logs / "first.parquet")
        write_log(MotionLog(log.fs, q(log.q), tau(log.tau), log.torque), tmp_path / name)
        return tmp_path / name

    return write


def test_robot_tells_what_can_be_identified(told):
    code, out, _ = told("robot", "scara")
    assert code == 0
    assert "8 parameters that a motion can tell" in out
    code, out, _ = told("robot", Robot.path("scara"))
    assert code == 0
    assert "ZZ1 + Ia1 + 0.25 M2" in out
    assert "no motion shows" in out
    code, out, _ = told("robot", "puma560", "--armature", "all", "--add", "offset")
    assert "58 parameters that a motion can tell" in out  # 36 + 4 rotors of their own + 18 of friction
    assert "torque budget" in out
    assert "97.6" in out


def test_identify_validates_and_writes_the_file(told, logs, tmp_path):
    words = "--robot", "puma560", "--validate", logs / "second.parquet", "--write-mjcf", "out.xml", "--out", "results"
    code, out, err = told("identify", logs / "first.parquet", *words, "--no-rerun")
    assert code == 0, err
    assert "explicit: good: the torque of joint" in out
    assert "standing and turning, where friction is not determined: joint1" in out
    assert "written to out.xml: the robot with the parameters of the explicit model" in out
    made = standard_parameters(Robot.load(str(tmp_path / "out.xml")))
    truth = standard_parameters(Robot.load("puma560"))
    for name in ("Fv1", "Fs1", "Ia3", "Fs6"):
        assert made[name] == pytest.approx(truth[name], rel=0.02)
    summary = json.loads((tmp_path / "results" / "summary.json").read_text())
    assert summary["robot"] == "puma560"
    assert summary["validation"]["models"]["power"]["verdict"] == "good"
    assert len(summary["validation"]["models"]["explicit"]["position_error_rms"]) == 6


def test_without_a_second_log_the_end_of_the_first_is_held_out(told, logs):
    code, out, _ = told("identify", logs / "first.parquet", "--robot", "puma560", "--model", "explicit")
    assert code == 0
    assert "the last quarter of the log, by a fit of the rest" in out


def test_run_takes_any_robot(told, tmp_path):
    arm = load("arm")
    scenario = replace(arm, name="short", fs=250.0, trajectory=replace(arm.trajectory, moves=10))
    (tmp_path / "short.toml").write_text(to_toml(scenario))
    code, out, err = told("run", "short.toml", "--robot", "puma560", "--out", "mine")
    assert code == 0, err
    summary = json.loads((tmp_path / "mine" / "summary.json").read_text())
    assert summary["robot"] == "puma560"
    assert len(summary["truth"]) == 52
    code, out, err = told("identify", "mine", "--model", "explicit", "--label", "again")
    assert code == 0, err
    assert "added to the recording" in out


def test_a_fixed_trajectory_of_another_robot_is_replaced(told, tmp_path):
    (tmp_path / "two.toml").write_text(to_toml(replace(load("ideal"), name="two", fs=100.0)))
    code, out, err = told("run", "two.toml", "--robot", "panda", "--no-rerun")
    assert code == 0, err
    assert "is none for robot panda: it makes the random moves of scenario arm" in out
    assert (tmp_path / "runs" / "two-panda" / "summary.json").exists()


def test_parameters_can_be_left_out_and_laws_added(told, logs):
    words = "identify", logs / "first.parquet", "--robot", "puma560", "--model", "explicit"
    code, out, _ = told(*words, "--without", "XXR6", "XY6", "--add", "offset")
    assert code == 0
    assert "off6" in out
    assert "\n XXR6 " not in out
    code, _, err = told(*words, "--without", "XXX")
    assert code == 2
    assert "no parameter XXX" in err
    code, _, err = told(*words, "--add", "armature")
    assert code == 2
    assert "--add armature: that is no law of a joint's friction; known: viscous, coulomb, offset" in err


@pytest.mark.parametrize(
    ("robot", "message"),
    [
        ("panda", "the log has 6 joints, the robot 7: joint1, joint2"),
        ("scara", "the log has 6 joints, the robot 2: joint1, joint2"),
        ("kuka", "no robot 'kuka'; known: panda, puma560, scara"),
        ("gone.xml", "gone.xml': No such file or directory"),
    ],
)
def test_robots_that_do_not_fit(told, logs, robot, message):
    code, out, err = told("identify", logs / "first.parquet", "--robot", robot)
    assert code == 2
    assert message in err
    assert not out
    assert err.count("\n") == 1


def test_joints_by_name_are_put_in_order_and_unknown_ones_refused(told, logs, tmp_path):
    from pyarrow import csv, parquet

    table = parquet.read_table(logs / "first.parquet")
    order = [0, 3, 1, 2, 4, 6, 5]  # of t and the joints
    columns = [table.column_names[k] for k in order] + [table.column_names[6 + k] for k in order[1:]]
    mixed = table.select(columns).replace_schema_metadata({})
    names = [name.replace("tau", "tau_joint").replace("q", "q_joint") for name in columns]
    csv.write_csv(mixed.rename_columns(names), tmp_path / "named.csv")
    words = "--robot", "puma560", "--model", "explicit", "--torque", "held", "--torque-delay", "0.000659"
    code, out, err = told("identify", "named.csv", *words)
    assert code == 0, err
    _, plain, _ = told("identify", logs / "first.parquet", *words)
    assert next(x for x in out.splitlines() if " MYR3 " in x) == next(x for x in plain.splitlines() if " MYR3 " in x)
    csv.write_csv(mixed.rename_columns([name.replace("joint3", "elbow") for name in names]), tmp_path / "other.csv")
    code, _, err = told("identify", "other.csv", *words)
    assert code == 2
    assert "missing: joint3; not the robot's: elbow" in err


def test_a_log_in_degrees_is_pointed_out(told, changed):
    path = changed(q=np.rad2deg)
    _, out, err = told("identify", path, "--robot", "puma560", "--model", "explicit")
    assert "are positions logged in degrees? They must be in rad" in out + err


def test_positions_out_of_range_are_pointed_out(told, changed):
    path = changed(q=lambda q: q + 10)
    _, out, err = told("identify", path, "--robot", "puma560", "--model", "explicit")
    assert "out of its range" in out + err
    assert "are joints in the order of the robot's file, and counted from its zero in its direction?" in out + err


def test_torques_of_the_wrong_sign_are_pointed_out(told, changed):
    code, out, _ = told("identify", changed(tau=np.negative), "--robot", "puma560", "--model", "explicit")
    assert code == 0
    assert "friction drives joint1, joint2, joint3, joint4, joint5, joint6 in the explicit model" in out
    assert "the torques of the log take out" in out
    code, out, _ = told(
        "identify", changed(tau=lambda tau: tau * [1, 1, 1, 1, 1, -1]), "--robot", "puma560", "--model", "explicit"
    )
    assert "friction drives joint6 in the explicit model: does the torque have the wrong sign" in out


def test_a_joint_that_stands_is_told_with_the_move_that_helps(told, changed):
    def hold(x):
        return np.where(np.arange(6) == 5, 0.0, x)

    code, _, err = told("identify", changed(q=hold), "--robot", "puma560", "--model", "explicit")
    assert code == 2
    assert "the motion does not show" in err
    assert "joint6 never moves in this log: move it" in err


def test_the_closed_form_is_written_too(told, tmp_path):
    """ZZR1 ... of the paper are base parameters of the links: bodies that have them are found."""
    code, _, err = told("run", "ideal", "--no-rerun", "--out", "mine")
    assert code == 0, err
    code, _, err = told("identify", "mine/log.parquet", "--write-mjcf", "out.xml")
    assert code == 0, err
    made = standard_parameters(Robot.load(str(tmp_path / "out.xml")))
    assert made["ZZ1"] + made["Ia1"] + 0.25 * made["M2"] == pytest.approx(3.5, rel=1e-3)
    assert 0.5 * made["MX2"] == pytest.approx(0.12, rel=1e-2)


ARM = """
<mujoco><worldbody><geom type="plane" size="2 2 0.1"/>
  <body name="a" pos="0 0 0.5"><joint name="turn" axis="0 0 1"/><geom size="0.1" pos="0.1 0 0"/>
    <body name="b" pos="0.1 0 0"><joint name="reach" type="slide" axis="1 0 0" range="0 0.4" damping="3"/><geom size="0.1"/>
    </body></body></worldbody></mujoco>
"""
"""A hinge without range, a short slide, bodies that overlap each other and a floor, no motors."""


@pytest.fixture
def arm(tmp_path):
    (tmp_path / "arm.xml").write_text(ARM)
    arm = load("arm")
    for name, moves, seed in (("first", 16, 0), ("second", 8, 3)):
        trajectory = replace(arm.trajectory, moves=moves, seed=seed)
        (tmp_path / f"{name}.toml").write_text(to_toml(replace(arm, name=name, fs=250.0, trajectory=trajectory)))
    return tmp_path / "arm.xml"


def test_a_file_without_motors_ranges_and_room_is_described_simulated_and_judged(told, arm):
    code, out, err = told("robot", "arm.xml")
    assert code == 0, err
    assert "torque budget" in out
    for name in ("first", "second"):
        code, out, err = told("run", f"{name}.toml", "--robot", "arm.xml", "--out", name, "--no-rerun")
        assert code == 0, err
        assert "has no motors (dcmotor elements of MJCF): its drives are ideal" in out
    code, out, err = told("export", "first")
    assert f"--robot {arm}" in out
    words = "--validate", "second", "--write-mjcf", "out.xml", "--model", "explicit", "--out", "found", "--no-rerun"
    code, out, err = told("identify", "first", *words)
    assert code == 0, err
    assert "explicit: good" in out
    summary = json.loads((arm.parent / "found" / "summary.json").read_text())
    assert max(summary["validation"]["models"]["explicit"]["position_error_rms"]) < 1e-3


def test_an_offset_is_no_error_of_the_simulated_robot(told, changed):
    path = changed(tau=lambda tau: tau + [5, -8, 4, 1, -1, 0.5])
    words = "identify", path, "--robot", "puma560", "--model", "explicit"
    _, out, _ = told(*words)
    assert "worth a try: --add offset" in out
    code, out, err = told(*words, "--add", "offset", "--out", "found", "--no-rerun", "--write-mjcf", "out.xml")
    assert code == 0, err
    assert "explicit: good" in out
    assert "off1, off2, off3, off4, off5, off6 have no place in an MJCF file and are left out" in out
    summary = json.loads((path.parent / "found" / "summary.json").read_text())
    assert max(summary["validation"]["models"]["explicit"]["position_error_rms"]) < 1e-3


def test_what_is_left_out_is_zero_in_the_file(told, logs, tmp_path):
    words = "--robot", "puma560", "--model", "explicit", "--without", "Fs6", "--write-mjcf", "out.xml"
    code, _, err = told("identify", logs / "first.parquet", *words)
    assert code == 0, err
    made = standard_parameters(Robot.load(str(tmp_path / "out.xml")))
    assert made["Fs6"] == pytest.approx(0, abs=1e-3)
    assert made["Fs5"] == pytest.approx(0.86, rel=0.02)
    code, _, err = told("identify", logs / "first.parquet", "--robot", "scara", "--without", "ZZR1")
    assert code == 2


def test_files_are_not_written_where_they_would_be_lost(told, logs, tmp_path):
    (tmp_path / "own.xml").write_text(Robot.path("puma560").read_text())
    words = "identify", logs / "first.parquet", "--robot", "own.xml", "--write-mjcf"
    for target, message in (
        ("own.xml", "is the robot's own file: choose another name"),
        ("out.txt", "its name must end with .xml"),
        ("no/such/out.xml", "there is no folder no/such"),
    ):
        code, out, err = told(*words, target)
        assert code == 2
        assert message in err
        assert not out


def test_names_of_joints_survive_resampling_and_other_columns_do_not_matter(told, logs, tmp_path):
    from pyarrow import csv, parquet

    table = parquet.read_table(logs / "first.parquet").replace_schema_metadata({})
    names = [name.replace("tau", "tau_joint").replace("q", "q_joint") for name in table.column_names]
    csv.write_csv(table.rename_columns(names), tmp_path / "named.csv")
    code, _, err = told("resample", "named.csv", "--fs", "200", "--out", "even.parquet", "--torque", "averaged")
    assert code == 0, err
    assert "tau_joint6" in parquet.read_table(tmp_path / "even.parquet").column_names
    csv.write_csv(table.append_column("q_wanted1", table["q1"]), tmp_path / "more.csv")
    words = "--robot", "puma560", "--torque", "held", "--model", "explicit"
    assert told("identify", "more.csv", *words)[0] == 0


@pytest.mark.parametrize("extra", ['<joint name="[red]a" stiffness="5"/>', '<joint name="a[/x]" stiffness="5"/>'])
def test_names_are_printed_as_they_are_and_springs_told(told, tmp_path, extra):
    site = '<actuator><motor site="s" gear="1 0 0 0 0 0" forcerange="-1 1"/></actuator>'
    (tmp_path / "r.xml").write_text(
        f'<mujoco><worldbody><body>{extra}<geom size="0.1"/><site name="s"/></body></worldbody>{site}</mujoco>'
    )
    code, out, err = told("robot", "r.xml")
    assert code == 0, err
    assert extra.split('"')[1] in out
    assert "has springs at" in out
    code, _, err = told("robot", "r.xml", "--without", "XXR1" if "XXR1" in out else "XX1", "Fv1", "Fs1", "MX1", "MY1")
    assert code == 2


def test_no_parameter_left_is_told(told):
    code, _, err = told("robot", "scara", "--without", "ZZR1", "Fv1", "Fs1", "ZZ2", "LMX2", "LMY2", "Fv2", "Fs2")
    assert code == 2
    assert "there is no parameter left" in err


def test_a_slide_in_millimetres_is_pointed_out(told, tmp_path, arm):
    code, _, err = told("run", "second.toml", "--robot", "arm.xml", "--out", "run", "--no-rerun")
    assert code == 0, err
    from identify.log_file import read_log

    log = read_log(tmp_path / "run" / "log.parquet")
    write_log(MotionLog(log.fs, log.q * [1, 1000], log.tau, log.torque), tmp_path / "mm.parquet")
    _, out, err = told("identify", "mm.parquet", "--robot", "arm.xml", "--model", "explicit")
    assert "are positions logged in millimetres? They must be in m" in out + err
