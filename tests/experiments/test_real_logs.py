"""What a laboratory meets on its first day, by simulated stand-ins: each fails without what it is about."""

import json
import re

import numpy as np
import pytest

from idbench.identify import MotionLog, TorqueChannel
from idbench.identify.files.log_file import read_log, write_log
from idbench.sim.robot.inverse_dynamics import coulomb_torque, inverse_dynamics
from idbench.sim.robot.robot import Robot

PUMA = ("--robot", "puma560")
EXPLICIT = "--robot puma560 --no-rerun --model explicit"


def as_csv(log, path, *, names=None, t=None, rows=slice(None), scale=(1.0, 1.0), qd=None):
    n = log.n
    heads = names or ["t", *(f"q{j + 1}" for j in range(n)), *(f"tau{j + 1}" for j in range(n))]
    heads += [f"qd{j + 1}" for j in range(n)] if qd is not None else []
    columns = [(log.t if t is None else t)[:, None], (log.q * scale[0])[rows], (log.tau * scale[1])[rows]]
    columns += [qd[rows]] if qd is not None else []
    lines = [",".join(heads), *(",".join(f"{x:.9g}" for x in row) for row in np.hstack(columns))]
    path.write_text("\n".join(lines) + "\n")
    return path


def unseen(summary, k=0, model="explicit"):
    return np.array(summary["validations"][k]["models"][model]["torque_error_rms"])


@pytest.fixture
def first(logs):
    return read_log(logs / "first.parquet")


@pytest.mark.thorough
def test_several_logs_of_other_rates_meanings_and_kinds_in_one_fit(ran, logs, first, tmp_path):
    """Two halves, one of them at a third of the rate, measured instead of averaged, in degrees and mN m."""
    half = first.samples // 2
    slow = first.part(half, first.samples)
    as_csv(
        MotionLog(slow.fs, slow.q, slow.tau, slow.torque), tmp_path / "b.csv", scale=(180 / np.pi, 1e3),
        names=["time", *(f"pos{j} [deg]" for j in range(6)), *(f"eff{j} [mNm]" for j in range(6))],
    )  # fmt: skip
    write_log(first.part(0, half), tmp_path / "a.parquet")
    ran("log b.csv --write")
    layout = (tmp_path / "b.toml").read_text().partition("[torque]")[0]
    (tmp_path / "b.toml").write_text(f'{layout}[torque]\nmeaning = "averaged"\ndelay = {first.torque.delay}\n')
    out, _, summary = ran("identify a.parquet b.csv", EXPLICIT, "--out out --validate", logs / "second.parquet")
    assert [log["name"] for log in summary["logs"]] == ["a.parquet", "b.csv"]
    errors = np.array([log["torque_error_rms"]["explicit"] for log in summary["logs"]])
    assert errors.shape == (2, 6)
    assert "residual of the explicit model in each log" in out
    one = ran("identify a.parquet", EXPLICIT, "--out one --validate", logs / "second.parquet").summary
    # Each half shows half of the motion: together they know more.
    sigmas = [np.array(x["models"]["explicit"]["sigma_noise"]) for x in (summary, one)]
    assert np.mean(sigmas[0] < sigmas[1]) > 0.9
    assert (unseen(summary) < 1.1 * unseen(one)).all()


@pytest.mark.thorough
def test_each_log_is_judged_by_itself(ran, logs, first, tmp_path):
    write_log(MotionLog(first.fs, first.q, 1.1 * first.tau, first.torque), tmp_path / "wrong.parquet")
    held_out = "--out out --validate", logs / "first.parquet", "wrong.parquet"
    out, _, summary = ran("identify", logs / "second.parquet", EXPLICIT, *held_out)
    assert (unseen(summary, 1) > 2 * unseen(summary, 0)).any()
    assert out.count(": torque error while moving") == 2
    assert summary["validation"] == summary["validations"][0]


@pytest.mark.thorough
def test_repeated_rows_are_left_out(ran, logs, first, tmp_path, rng):
    """One row in sixteen is the one before, written again."""
    seen = np.maximum.accumulate(np.where(rng.uniform(size=first.samples) > 0.06, np.arange(first.samples), 0))
    as_csv(first, tmp_path / "log.csv", t=first.t, rows=seen)
    words = "identify log.csv", EXPLICIT, "--torque averaged --validate", logs / "second.parquet"
    as_is, repaired = ran(*words, "--out as-is"), ran(*words, "--out repaired --resample")
    assert "repeat the row before while the robot moves: left out" in repaired.out
    before, after = unseen(as_is.summary), unseen(repaired.summary)
    assert (after < 1.1 * before).all()
    assert np.mean(after / before) < 0.9


def test_times_that_jitter_are_refused_with_the_way_out_which_works(idbench, first, tmp_path, rng):
    as_csv(first, tmp_path / "log.csv", t=first.t + 0.1 / first.fs * rng.normal(size=first.samples))
    _, _, told = idbench("identify", "log.csv", *PUMA, "--torque", "averaged")
    assert "add --resample, or write it anew and look: uv run idbench resample log.csv --torque averaged" in told
    code, out, _ = idbench("resample", "log.csv", "--torque", "averaged", "--out", "even.parquet")
    assert code == 0
    assert "stamps jitter by 0.4 ms about a steady clock of 250 Hz" in out
    made = read_log(tmp_path / "even.parquet")
    np.testing.assert_allclose(made.q, first.q[: made.samples], atol=2e-4)  # 0.1 ms, to which the clock is known, at 2 rad/s


def test_a_log_with_a_gap_becomes_two(ran, first, tmp_path):
    kept = (first.t < 3) | (first.t > 3.4)
    as_csv(first, tmp_path / "log.csv", t=first.t[kept], rows=kept)
    ran("resample log.csv --torque averaged --out even.parquet")
    assert read_log(tmp_path / "even1.parquet").samples == 750
    assert read_log(tmp_path / "even2.parquet").fs == pytest.approx(250.0)


@pytest.mark.thorough
def test_a_short_fast_log_gets_the_band_that_it_needs(idbench, ran, first, tmp_path):
    """Seven seconds: 70 instants at 5 Hz for 52 parameters, from which the power model cannot be identified at all."""
    write_log(first.part(0, round(7 * first.fs)), tmp_path / "short.parquet")
    words = ("identify", "short.parquet", *PUMA, "--no-rerun", "--model")
    out, _, chosen = ran(*words, "power --out chosen")
    assert "chosen by the log" in out
    assert "instants for 52 parameters, where 5 Hz leave 70" in out
    assert chosen["models"]["power"]["rows"] > 150
    _, out, _ = idbench(*words, "power", "--cutoff", "5")
    assert "this log does not excite" in " ".join(out.split())


@pytest.mark.thorough
def test_a_chain_of_a_file(ran, log, tmp_path):
    (tmp_path / "chain.toml").write_text('chain = "idbench"\n[operator]\ncutoff = 12.0\n[mask]\nkind = "none"\n')
    write_log(log, tmp_path / "log.parquet")
    words = "identify log.parquet --out file --chain-file chain.toml --no-rerun --model explicit"
    assert ran(words).summary["cutoff"] == 12.0


@pytest.mark.thorough
def test_a_robot_with_more_joints_than_the_log(idbench, ran, first, tmp_path):
    """The wrist was held: its columns are not in the log. What follows from them belongs to the forearm."""
    robot = Robot.load("puma560")
    held = np.concatenate([first.q[:, :3], np.zeros((first.samples, 3))], axis=1)
    qd, qdd = (np.gradient(held, 1 / first.fs, axis=0) for _ in range(2))
    qdd = np.gradient(qd, 1 / first.fs, axis=0)
    tau = inverse_dynamics(robot, held, qd, qdd) + coulomb_torque(robot, qd)
    arm = MotionLog(first.fs, held[:, :3], tau[:, :3], TorqueChannel("instantaneous"))
    write_log(arm, tmp_path / "arm.parquet")
    _, _, told = idbench("identify", "arm.parquet", *PUMA)
    names = robot.joints[:3]
    assert f"--joints {' '.join(names)} (the others are held at 0" in told
    out = ran("identify arm.parquet", EXPLICIT, "--write arm.xml --joints", *names).out
    assert re.match(r"Result: (good|fair): torques within 0\.0", out)
    assert Robot.load(str(tmp_path / "arm.xml")).joints == names


@pytest.mark.thorough
def test_torques_that_do_not_see_rotors_are_told_apart(ran, logs, first, tmp_path):
    """Sensors behind the gears: what the robot's file says of rotors is missing in the torques."""
    qdd = np.gradient(np.gradient(first.q, 1 / first.fs, axis=0), 1 / first.fs, axis=0)
    rotors = Robot.load("puma560").model.dof_armature
    smooth = np.apply_along_axis(lambda x: np.convolve(x, np.ones(5) / 5, mode="same"), 0, qdd)
    write_log(MotionLog(first.fs, first.q, first.tau - 1.2 * rotors * smooth, first.torque), tmp_path / "links.parquet")
    words = f"identify links.parquet {EXPLICIT}"
    said = "are these torques measured at the links, behind the gears? Then add --armature none"
    assert said in " ".join(ran(words).out.split())
    assert "measured at the links" not in ran("identify", logs / "first.parquet", EXPLICIT).out
    summary = ran(words, "--armature none --friction none --out out").summary
    assert not [name for name in summary["parameters"] if name.startswith(("Ia", "Fv", "Fs"))]


@pytest.mark.thorough
def test_the_report_says_in_a_minute_whether_to_trust_it(ran, logs, tmp_path):
    words = "--robot puma560 --out out --no-rerun --torque-delay 0.001 --validate"
    summary = ran("identify", logs / "first.parquet", words, logs / "second.parquet").summary
    page = (tmp_path / "out" / "report.html").read_text()
    for words in ("explicit", "Check these first", "held-out log", "--torque-delay", "XX", "Friction", "residuals"):
        assert words in page, words
    # Torques, residuals, friction and spectra of six joints, and what the wrong delay explains.
    assert page.count('<div class="panels">') == 5
    assert page.count('<svg class="curves"') == 25
    assert page.count('<svg class="interval"') == len(summary["parameters"])
    assert 'src="http' not in page
    assert "<link" not in page
    assert f"--validate {logs / 'second.parquet'}" in page


def test_a_log_is_shown_and_drawn(idbench, first, tmp_path):
    as_csv(first, tmp_path / "log.csv", qd=np.gradient(first.q, 1 / first.fs, axis=0))
    code, out, _ = idbench("log", "log.csv", "--picture", "log.png", "--json")
    assert code == 0
    told = json.loads(out)
    assert told["fs"] == pytest.approx(250.0)
    assert [row["joint"] for row in told["joints"]] == [f"joint {j + 1}" for j in range(6)]
    assert "logged velocities agree" in " ".join(told["notes"])
    assert (tmp_path / "log.png").read_bytes().startswith(b"\x89PNG")
