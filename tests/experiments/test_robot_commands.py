"""Any robot from the command line, as a user asks."""

from dataclasses import replace

import pytest
from pyarrow import csv, parquet

from idbench.sim.robot.robot import Robot
from idbench.sim.robot.tree import standard_parameters
from idbench.sim.scenario.scenario_file import load, to_toml


def test_robot_tells_what_can_be_identified(ran):
    assert "8 parameters that a motion can identify" in ran("robot scara").out
    out = ran("robot", Robot.path("scara")).out
    assert "ZZ1 + Ia1 + 0.25 M2" in out
    assert "no motion excites" in out
    out = ran("robot puma560 --armature all --add offset").out
    assert "58 parameters that a motion can identify" in out  # 36 + 4 rotors of their own + 18 of friction
    assert "torque budget" in out
    assert "97.6" in out


@pytest.mark.thorough
def test_identify_validates_and_writes_the_file(ran, logs, tmp_path):
    words = "--robot puma560 --write out.xml --out results --no-rerun -v --validate"
    out, _, summary = ran("identify", logs / "first.parquet", words, logs / "second.parquet")
    assert "explicit: good: the torque of joint" in out
    assert "at rest and reversing, where friction is not determined: joint1" in out
    assert "written to out.xml: the robot with the parameters of the explicit model" in out
    made = standard_parameters(Robot.load(str(tmp_path / "out.xml")))
    truth = standard_parameters(Robot.load("puma560"))
    for name in ("Fv1", "Fs1", "Ia3", "Fs6"):
        assert made[name] == pytest.approx(truth[name], rel=0.02)
    assert summary["robot"] == "puma560"
    assert summary["validation"]["models"]["power"]["verdict"] == "good"
    assert len(summary["validation"]["models"]["explicit"]["position_error_rms"]) == 6


@pytest.mark.thorough
def test_a_fixed_trajectory_of_another_robot_is_replaced(ran, tmp_path):
    (tmp_path / "two.toml").write_text(to_toml(replace(load("ideal"), name="two", fs=100.0)))
    out = ran("run two.toml --robot panda --no-rerun --estimator WLS").out
    assert "does not fit robot panda: the random moves of scenario arm are used" in out
    assert (tmp_path / "runs" / "two-panda" / "summary.json").exists()


@pytest.mark.thorough
def test_parameters_can_be_left_out_and_laws_added(idbench, logs):
    words = "identify", logs / "first.parquet", "--robot", "puma560", "--model", "explicit"
    code, out, _ = idbench(*words, "--without", "XXR6", "XY6", "--add", "offset")
    assert code == 0
    assert "off6" in out
    assert "XXR6  " not in out
    code, _, err = idbench(*words, "--without", "XXX")
    assert code == 2
    assert "no parameter XXX" in err
    code, _, err = idbench(*words, "--add", "armature")
    assert code == 2
    assert "--add armature: that is no law of a joint's friction; known: viscous, coulomb, offset" in err


def by_joint(columns):
    """Return the names of columns as of a log whose joints have names."""
    return [name.replace("tau", "tau_joint").replace("q", "q_joint") for name in columns]


@pytest.mark.thorough
def test_joints_by_name_are_put_in_order_and_unknown_ones_refused(idbench, ran, logs, tmp_path):
    table = parquet.read_table(logs / "first.parquet")
    order = [0, 3, 1, 2, 4, 6, 5]  # of t and the joints
    columns = [table.column_names[k] for k in order] + [table.column_names[6 + k] for k in order[1:]]
    mixed = table.select(columns).replace_schema_metadata({})
    csv.write_csv(mixed.rename_columns(by_joint(columns)), tmp_path / "named.csv")
    words = "--robot puma560 --model explicit --torque held --torque-delay 0.000659"
    out, plain = ran("identify named.csv", words).out, ran("identify", logs / "first.parquet", words).out
    assert next(x for x in out.splitlines() if " MYR3 " in x) == next(x for x in plain.splitlines() if " MYR3 " in x)
    csv.write_csv(mixed.rename_columns([name.replace("joint3", "elbow") for name in by_joint(columns)]), tmp_path / "other.csv")
    code, _, err = idbench("identify", "other.csv", *words.split())
    assert code == 2
    assert "missing: joint3; not the robot's: elbow" in err


@pytest.mark.thorough
def test_the_closed_form_is_written_too(ran, tmp_path):
    """ZZR1 ... of the paper are base parameters of the links: bodies that have them are found."""
    ran("run ideal --no-rerun --out mine")
    ran("identify mine/log.parquet --write out.xml")
    made = standard_parameters(Robot.load(str(tmp_path / "out.xml")))
    assert made["ZZ1"] + made["Ia1"] + 0.25 * made["M2"] == pytest.approx(3.5, rel=1e-3)
    assert 0.5 * made["MX2"] == pytest.approx(0.12, rel=1e-2)


@pytest.mark.thorough
def test_a_file_without_motors_ranges_and_room_is_described_simulated_and_judged(ran, arm):
    assert "torque budget" in ran("robot arm.xml").out
    for name in ("first", "second"):
        out = ran(f"run {name}.toml --robot arm.xml --out {name} --no-rerun").out
        assert "has no motors (dcmotor elements of MJCF): its drives are ideal" in out
    assert f"--robot {arm}" in ran("export first").out
    words = "--validate second --write out.xml --model explicit --out found --no-rerun"
    out, _, summary = ran("identify first", words)
    assert out.startswith("Result: good: torques within ")
    assert max(summary["validation"]["models"]["explicit"]["position_error_rms"]) < 1e-3


@pytest.mark.thorough
def test_an_offset_is_no_error_of_the_simulated_robot(ran, changed):
    path = changed(tau=lambda tau: tau + [5, -8, 4, 1, -1, 0.5])
    words = "identify", path, "--robot puma560 --model explicit"
    assert "with --add offset the worst joint's error falls from" in ran(*words).out
    out, _, summary = ran(*words, "--add offset --out found --no-rerun --write out.xml")
    assert out.startswith("Result: good: torques within ")
    assert "off1, off2, off3, off4, off5, off6 have no place in the file and are left out" in out
    assert max(summary["validation"]["models"]["explicit"]["position_error_rms"]) < 1e-3


@pytest.mark.thorough
def test_what_is_left_out_is_zero_in_the_file(idbench, ran, logs, tmp_path):
    ran("identify", logs / "first.parquet", "--robot puma560 --model explicit --without Fs6 --write out.xml")
    made = standard_parameters(Robot.load(str(tmp_path / "out.xml")))
    assert made["Fs6"] == pytest.approx(0, abs=1e-3)
    assert made["Fs5"] == pytest.approx(0.86, rel=0.02)
    assert idbench("identify", logs / "first.parquet", "--robot", "scara", "--without", "ZZR1")[0] == 2


@pytest.mark.thorough
def test_names_of_joints_survive_resampling_and_other_columns_do_not_matter(ran, logs, tmp_path):
    table = parquet.read_table(logs / "first.parquet").replace_schema_metadata({})
    csv.write_csv(table.rename_columns(by_joint(table.column_names)), tmp_path / "named.csv")
    ran("resample named.csv --fs 200 --out even.parquet --torque averaged")
    assert "tau_joint6" in parquet.read_table(tmp_path / "even.parquet").column_names
    csv.write_csv(table.append_column("q_wanted1", table["q1"]), tmp_path / "more.csv")
    ran("identify more.csv --robot puma560 --torque held --model explicit")
