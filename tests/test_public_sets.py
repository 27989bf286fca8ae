"""The program that identifies public sets of logs, from definitions to a table."""

import json
import shutil
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from idbench.experiments.cli import main
from idbench.identify import MotionLog, TorqueChannel
from idbench.identify.files.log_file import write_log
from idbench.sim.engine.simulation import simulate
from idbench.sim.robot.inverse_dynamics import coulomb_torque, inverse_dynamics
from idbench.sim.robot.robot import Robot
from idbench.sim.scenario.scenario_file import load, to_toml
from idbench.sim.trajectories import RandomMoves

FOLDER = Path(__file__).parent / "benchmarks"
DEFINITION = """
title = "A SCARA"
fit = ["one.parquet", "two.parquet"]
held_out = ["new.parquet"]
identify = {robot = "scara", model = "explicit"}
"""
SERVO = """
title = "A servo"
fit = ["fit-*.parquet"]
held_out = ["new.parquet"]
servo = {robot = "pendulum", servo = "servo.toml", friction = "coulomb"}
"""


@pytest.fixture
def program(monkeypatch):
    """The modules of the program."""
    monkeypatch.syspath_prepend(str(FOLDER))
    import public_sets

    return public_sets


@pytest.fixture
def rows_of(program, tmp_path, monkeypatch):
    """What makes rows of sets into a folder, and returns exit code and rows."""

    def run(*sets):
        monkeypatch.setattr("sys.argv", ["public_sets.py", *map(str, sets), "--out", str(tmp_path / "found")])
        code = program.main()
        summaries = [tmp_path / "found" / each.name / "summary.json" for each in sets]
        return code, [json.loads(path.read_text()) for path in summaries if path.exists()]

    return run


@pytest.fixture(scope="session")
def scara_logs():
    """Three logs of a SCARA with torque noise."""
    plain = load("ideal")
    noisy = replace(plain.torque, noise=(0.05, 0.02))
    moves = [RandomMoves(moves=10, durations=(0.8, 1.4), rest=0.3, seed=seed) for seed in range(3)]
    return [simulate(replace(plain, trajectory=each, torque=noisy, seed=seed)).alone() for seed, each in enumerate(moves)]


@pytest.fixture
def arm(tmp_path, scara_logs):
    """The folder of a set."""
    folder = tmp_path / "arm"
    folder.mkdir()
    for name, log in zip(("one", "two", "new"), scara_logs, strict=True):
        write_log(log, folder / f"{name}.parquet")
    (folder / "benchmark.toml").write_text(DEFINITION)
    return folder


def changed(folder, old, new):
    path = folder / "benchmark.toml"
    assert old in path.read_text()
    path.write_text(path.read_text().replace(old, new))


def test_a_set_becomes_a_row_beside_published_figures(arm, rows_of, capfd):
    figure = 'published = [{value = 7.5, metric = "torque error", split = "all of it fitted", by = "A. Body"}]\n'
    (arm / "benchmark.toml").write_text(figure + DEFINITION)
    code, (row,) = rows_of(arm)
    assert code == 0
    assert (row["verdict"], row["logs"][0]["samples_seen"], row["repeats"]["compared"]) == ("good", 0, 8)
    assert min(row["logs"][0]["R2"]) > 0.99
    from set_tables import share

    own = np.median(share(row, row["logs"]))
    said = f"torque error: idbench {own:.3g} % on the held-out logs of this set; published 7.5 % (A. Body: all of it fitted)"
    assert said in capfd.readouterr().out


@pytest.mark.parametrize("friction", ["standard", pytest.param("standard+arctan", marks=pytest.mark.thorough)])
def test_torques_of_other_tools_are_judged_on_the_same_rows(arm, scara_logs, rows_of, tmp_path, friction):
    """Right ones, none, our own (of laws that are linear about an estimate, too), and files that are none."""
    changed(arm, 'robot = "scara"', f'robot = "scara", friction = "{friction}"')
    rows_of(arm)
    out, log = tmp_path / "found" / "arm", scara_logs[2]
    exported = dict(np.load(out / "held_out1.npz"))
    from set_tools import prepared

    for name, values in prepared(log).items():
        np.testing.assert_array_equal(exported[name], values)
    robot, qd = Robot.load("scara"), np.gradient(log.q, 1 / log.fs, axis=0)
    right = inverse_dynamics(robot, log.q, qd, np.gradient(qd, 1 / log.fs, axis=0)) + coulomb_torque(robot, qd)
    np.savez(out / "predicted-right.npz", held_out1=right, seconds=1.5, note="from the file")
    np.savez(out / "predicted-none.npz", held_out1=0 * right)
    np.savez(out / "predicted-short.npz", held_out1=right[:-1])
    np.savez(out / "predicted-own.npz", held_out1=exported["idbench"])
    (out / "predicted-text.npz").write_text("no arrays")
    np.savez(out / "predicted-empty.npz", seconds=1.0)
    _, (row,) = rows_of(arm)
    own, tools = row["logs"][0], row["tools"]
    level = np.array(own["torque_rms"])
    assert tools["right"]["seconds"] == 1.5
    # Differences over one sample are late or early where accelerations jump.
    assert (np.array(tools["right"]["logs"][0]["torque_error_rms"]) < 0.01 * level).all()
    assert tools["none"]["logs"][0]["torque_error_rms"] == pytest.approx(level.tolist(), rel=1e-6)
    assert "shape" in tools["short"]["logs"][0]["failure"]
    # Torques go to the instants when they act and back, through splines.
    again = np.array(tools["own"]["logs"][0]["torque_error_rms"])
    np.testing.assert_allclose(again, own["torque_error_rms"], atol=2e-3 * level.min())
    assert all("must have held_out1" in tools[name]["failure"] for name in ("text", "empty"))


def test_without_held_out_logs_the_last_quarter_is(arm, scara_logs, rows_of):
    changed(arm, 'held_out = ["new.parquet"]\n', "")
    _, (row,) = rows_of(arm)
    assert "last quarter" in row["logs"][0]["title"]
    longest = max(scara_logs[:2], key=lambda log: log.samples).samples
    assert row["logs"][0]["samples"] == longest - round(0.75 * longest)


def test_samples_that_the_fit_has_seen_are_counted_before_they_are_resampled(arm, scara_logs, rows_of, capfd):
    """Files with gaps, whose samples are put on another clock: half of the held-out one is a part of a fitted one."""
    rng = np.random.default_rng(0)
    for name, log in zip(("one", "two", "new"), (scara_logs[0], scara_logs[1], scara_logs[0]), strict=True):
        kept = rng.random(log.samples) < 0.9
        kept[: 0 if name != "new" else log.samples // 2] = False
        rows = np.column_stack([log.t + rng.uniform(0, 1e-4, log.samples), log.q, log.tau])[kept]
        np.savetxt(arm / f"{name}.csv", rows, delimiter=",", header="t,q1,q2,tau1,tau2", comments="")
    changed(arm, ".parquet", ".csv")
    changed(arm, 'robot = "scara"', 'robot = "scara", torque = "held", torque_delay = 0, resample = true')
    _, (row,) = rows_of(arm)
    # Nine tenths of the rows of each are kept, by chance: four fifths are in both.
    assert row["logs"][0]["samples_seen"] > 0.3 * scara_logs[0].samples
    assert "are also in the fitted logs" in capfd.readouterr().out


def test_repeats_keep_the_delay_and_free_runs_stay(arm, scara_logs, rows_of):
    """Logs 10 ms late, which the fit finds; without the delay friction and inertias of single logs differ."""
    for name, log in zip(("one", "two", "new"), scara_logs, strict=True):
        write_log(MotionLog(log.fs, log.q[1:], log.tau[:-1], TorqueChannel("instantaneous")), arm / f"{name}.parquet")
    changed(arm, 'model = "explicit"}', 'model = "explicit", torque_delay = "estimate"}\nfree_run = 0.2')
    _, (row,) = rows_of(arm)
    assert row["repeats"]["inside"] >= 6
    assert row["free_run"][0]["diverged"] == 0
    assert max(row["free_run"][0]["nrmse"]) < 0.1


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ("fitt = []", "fit"),
        ("fit = []", "at least one log"),
        ('identify = {robto = "scara"}', "unknown key 'robto' (did you mean 'robot'?)"),
        ('identify = {robot = "scara", model = "evil:X"}', "evil:X"),
        ('servo = {robot = "scara"}', "give one table, [identify] or [servo]"),
        ('held_out = ["gone.csv"]\nget = "ask them"', "gone.csv; get the data with: ask them"),
        ('published = [{value = 1.0, metric = "R2", split = "", by = ""}]', "metric = 'R2': must be 'torque error'"),
    ],
)
def test_wrong_definitions_are_refused_and_leave_the_others(arm, rows_of, tmp_path, monkeypatch, capfd, change, words):
    monkeypatch.syspath_prepend(str(arm))
    shutil.copytree(arm, tmp_path / "good")
    (arm / "evil.py").write_text("raise SystemExit('evil ran')\n")
    kept = [line for line in DEFINITION.splitlines() if not line.startswith(f"{change.partition(' ')[0]} =")]
    (arm / "benchmark.toml").write_text("\n".join([*kept, change]) + "\n")
    code, rows = rows_of(arm, tmp_path / "good")
    assert (code, len(rows)) == (1, 1)
    assert words in capfd.readouterr().err
    assert "evil" not in sys.modules


@pytest.mark.parametrize("name", sorted(path.parent.name for path in FOLDER.glob("public/*/benchmark.toml")))
def test_sets_that_ship_lack_nothing_but_their_data(program, name):
    folder = FOLDER / "public" / name
    with pytest.raises(program.ExperimentError, match="get the data with"):
        program.read_definition(folder)


def test_errors_over_logs_are_pooled(program):
    from set_tables import share

    logs = [{"torque_error_rms": [1.0], "torque_rms": [10.0]}, {"torque_error_rms": [0.1], "torque_rms": [0.2]}]
    assert share({"logs": logs}, logs)[0] == pytest.approx(100 * np.sqrt(1.01 / 100.04))


def test_tools_get_late_torques_without_loss(program):
    """At 10 Hz, where straight lines between samples would take a fifth of what moves at 2 Hz."""
    from set_tools import prepared

    t = np.arange(200) / 10
    tau = np.sin(2 * np.pi * t)[:, None]
    late = MotionLog(10.0, tau, np.sin(2 * np.pi * (t + 0.05))[:, None], TorqueChannel("instantaneous", delay=0.05))
    assert np.abs(prepared(late)["tau"] - tau)[5:-5].max() < 0.01


@pytest.mark.thorough
def test_servos_are_judged_by_positions_from_commands_alone(rows_of, tmp_path, capfd):
    folder, plain = tmp_path / "bench", load("servo")
    folder.mkdir()
    for seed, name in enumerate(("fit-1", "new")):
        scenario = replace(plain, seed=seed, trajectory=replace(plain.trajectory, seed=seed))
        (tmp_path / "one.toml").write_text(to_toml(scenario))
        assert main(["run", str(tmp_path / "one.toml"), "--out", str(tmp_path / f"run{seed}"), "--no-rerun"]) == 0
        shutil.copy(tmp_path / f"run{seed}" / "log.parquet", folder / f"{name}.parquet")
    shutil.copy(tmp_path / "run0" / "servo.toml", folder)
    (folder / "benchmark.toml").write_text(SERVO)
    _, (row,) = rows_of(folder)
    assert "from commands alone" in capfd.readouterr().out
    truth, found = plain.drive, row["estimate"][row["joints"][0]]
    for name, true in (("a", truth.torque_constant[0] / truth.resistance[0]), ("rate", truth.rate)):
        assert abs(found[name]["value"] - true) < 4 * found[name]["sigma"], name
    assert row["logs"][0]["position_error"][0] < 4 * 2 * np.pi / truth.counts
    assert 0 < row["free_run"][0]["nrmse"][0] < 0.01


def test_the_bench_that_ships_becomes_logs(program, tmp_path, monkeypatch):
    """Its script, given runs as the public set has them."""
    monkeypatch.chdir(tmp_path)
    for name in ("benchmark.toml", "prepare.py"):
        shutil.copy(FOLDER / "public" / "sts3215" / name, tmp_path)
    entry = {"timestamp": 7.5, "position": 0.25, "goal_position": 0.5, "torque_enable": True}
    for k, mass in enumerate((0.535, 0.741, 1.1682, 0.535)):
        run = {"mass": mass, "length": 0.1, "kp": 8, "trajectory": "brutal", "entries": [entry, {**entry, "timestamp": 7.51}]}
        (tmp_path / f"{k}.json").write_text(json.dumps(run))
    monkeypatch.setattr("sys.argv", ["prepare.py", "."])
    exec(compile((tmp_path / "prepare.py").read_text(), "prepare.py", "exec"), {"__name__": "__main__"})
    definition = program.read_definition(tmp_path)
    assert definition.fit == ("535g-100mm-kp8-brutal-1.csv", "535g-100mm-kp8-brutal-2.csv", "1168g-100mm-kp8-brutal-1.csv")
    assert definition.held_out == ("741g-100mm-kp8-brutal-1.csv",)
    t, q, command, on = np.loadtxt("741g-100mm-kp8-brutal-1.csv", delimiter=",", skiprows=1)[1]
    assert (t, q, command, on) == pytest.approx((0.01, 0.25, 0.5, 1))
