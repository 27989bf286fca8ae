"""`idbench benchmark`: sets of logs, from definitions to a table."""

import json
import shutil
import sys
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from typing import get_args, get_type_hints

import numpy as np
import pytest

from idbench.experiments.benchmark.definition import SHIPPED, PublishedFigure, read_definition, shipped
from idbench.experiments.benchmark.files import files_of
from idbench.experiments.benchmark.job import set_row
from idbench.experiments.benchmark.tables import METRICS, share
from idbench.experiments.benchmark.tools import prepared
from idbench.experiments.cli import main
from idbench.identify import MotionLog, TorqueChannel
from idbench.identify.files.log_file import write_log
from idbench.sim.robot.inverse_dynamics import coulomb_torque, inverse_dynamics
from idbench.sim.robot.robot import Robot


def row_of(out, name="arm"):
    return json.loads((out / name / "summary.json").read_text())


def test_a_set_becomes_a_row_and_is_kept(scara_set, tmp_path, capfd, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert main(["benchmark", "arm", "--out", "found"]) == 0
    printed = capfd.readouterr().out
    assert "A SCARA" in printed
    row = row_of(tmp_path / "found")
    assert row["verdict"] == "good"
    assert min(row["logs"][0]["R2"]) > 0.99
    assert row["logs"][0]["samples_seen"] == 0
    assert row["repeats"]["compared"] == 8
    assert (tmp_path / "found" / "report.html").read_text().count("A SCARA") >= 2
    written = (tmp_path / "found" / "arm" / "summary.json").stat().st_mtime_ns
    assert main(["benchmark", "arm", "--out", "found"]) == 0
    assert capfd.readouterr().out == printed  # seconds, too: nothing was made again
    assert (tmp_path / "found" / "arm" / "summary.json").stat().st_mtime_ns == written
    (scara_set / "benchmark.toml").write_text((scara_set / "benchmark.toml").read_text().replace("A SCARA", "Another"))
    assert main(["benchmark", "arm", "--out", "found"]) == 0
    assert row_of(tmp_path / "found")["title"] == "Another"


def test_published_figures_stand_beside_the_own_one_by_the_same_metric(scara_set, tmp_path, capfd, monkeypatch):
    monkeypatch.chdir(tmp_path)
    figure = 'published = [{value = 7.5, metric = "torque error", split = "all of it fitted", by = "A. Body"}]\n'
    text = (scara_set / "benchmark.toml").read_text()
    (scara_set / "benchmark.toml").write_text(figure + text)
    assert main(["benchmark", "arm", "--out", "found"]) == 0
    row = row_of(tmp_path / "found")
    own = np.median(share(row, row["logs"]))
    said = f"torque error: idbench {own:.3g} % on the held-out logs of this set; published 7.5 % (A. Body: all of it fitted)"
    assert said in capfd.readouterr().out
    assert said in (tmp_path / "found" / "report.html").read_text()


def test_every_metric_that_a_set_may_state_has_a_figure():
    assert set(get_args(get_type_hints(PublishedFigure)["metric"])) == METRICS.keys()


def test_torques_of_other_tools_are_judged_on_the_same_rows(scara_set, scara_logs, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert main(["benchmark", "arm", "--out", "found"]) == 0
    out, log = tmp_path / "found" / "arm", scara_logs[2]
    exported = dict(np.load(out / "held_out1.npz"))
    for name, values in prepared(log).items():
        np.testing.assert_array_equal(exported[name], values)
    robot = Robot.load("scara")
    qd = np.gradient(log.q, 1 / log.fs, axis=0)
    right = inverse_dynamics(robot, log.q, qd, np.gradient(qd, 1 / log.fs, axis=0)) + coulomb_torque(robot, qd)
    np.savez(out / "predicted-right.npz", held_out1=right, seconds=1.5, note="from the file")
    np.savez(out / "predicted-none.npz", held_out1=0 * right)
    np.savez(out / "predicted-short.npz", held_out1=right[:-1])
    assert main(["benchmark", "arm", "--out", "found"]) == 0
    row = row_of(tmp_path / "found")
    own, tools = row["logs"][0], row["tools"]
    assert tools["right"]["seconds"] == 1.5
    level = np.array(own["torque_error_rms"]) / np.array(own["torque_error_percent"]) * 100
    # Differences over one sample are late or early where accelerations jump.
    assert (np.array(tools["right"]["logs"][0]["torque_error_rms"]) < 0.01 * level).all()
    assert tools["none"]["logs"][0]["torque_error_rms"] == pytest.approx(level.tolist(), rel=1e-6)
    assert "shape" in tools["short"]["logs"][0]["failure"]


@pytest.mark.parametrize("friction", ["standard", "standard+arctan"])
def test_own_torques_are_written_and_judged_alike(scara_set, tmp_path, monkeypatch, friction):
    """Also of laws that are linear about an estimate, whose columns have a part that is known."""
    monkeypatch.chdir(tmp_path)
    text = (scara_set / "benchmark.toml").read_text()
    (scara_set / "benchmark.toml").write_text(text.replace("--robot scara", f"--robot scara --friction {friction}"))
    assert main(["benchmark", "arm", "--out", "found"]) == 0
    out = tmp_path / "found" / "arm"
    np.savez(out / "predicted-own.npz", held_out1=np.load(out / "held_out1.npz")["idbench"])
    (out / "predicted-text.npz").write_text("no arrays")
    np.savez(out / "predicted-empty.npz", seconds=1.0)
    assert main(["benchmark", "arm", "--out", "found"]) == 0
    row = row_of(tmp_path / "found")
    own, level = (np.array(row["logs"][0][name]) for name in ("torque_error_rms", "torque_rms"))
    again = np.array(row["tools"]["own"]["logs"][0]["torque_error_rms"])
    # Torques go to the instants when they act and back, through splines.
    np.testing.assert_allclose(again, own, atol=2e-3 * level.min())
    for tool in ("text", "empty"):
        assert "must have held_out1" in row["tools"][tool]["failure"]


def test_without_held_out_logs_the_last_quarter_is(scara_set, scara_logs, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    text = (scara_set / "benchmark.toml").read_text()
    (scara_set / "benchmark.toml").write_text(text.replace('held_out = ["new.parquet"]\n', ""))
    assert main(["benchmark", "arm", "--out", "found"]) == 0
    row = row_of(tmp_path / "found")
    assert "last quarter" in row["logs"][0]["title"]
    longest = max(scara_logs[:2], key=lambda log: log.samples).samples
    assert row["logs"][0]["samples"] == longest - round(0.75 * longest)


def test_samples_that_the_fit_has_seen_are_counted(scara_set, scara_logs, tmp_path, monkeypatch, capfd):
    """A held-out log of which a half is a part of the fitted one."""
    monkeypatch.chdir(tmp_path)

    fitted, new = scara_logs[0], scara_logs[2]
    half = new.samples // 2
    q, tau = (np.concatenate([a[:half], b[:half]]) for a, b in ((new.q, fitted.q), (new.tau, fitted.tau)))
    write_log(replace(new, q=q, tau=tau), scara_set / "new.parquet")
    assert main(["benchmark", "arm", "--out", "found"]) == 0
    seen = row_of(tmp_path / "found")["logs"][0]["samples_seen"]
    moving = int((np.diff(fitted.q[:half], axis=0) != 0).any(axis=1).sum())
    assert moving - 1 <= seen <= half
    assert "are also in the fitted logs" in capfd.readouterr().out


def test_samples_are_counted_before_they_are_resampled(scara_set, scara_logs, tmp_path, monkeypatch):
    """Files with gaps, whose samples are put on another clock: those of one are a part of the other."""
    monkeypatch.chdir(tmp_path)
    rng = np.random.default_rng(0)
    for name, log in zip(("one", "two", "new"), (scara_logs[0], scara_logs[1], scara_logs[0]), strict=True):
        kept = rng.random(log.samples) < 0.9
        kept[: 0 if name != "new" else log.samples // 2] = False
        rows = np.column_stack([log.t + rng.uniform(0, 1e-4, log.samples), log.q, log.tau])[kept]
        head = "t,q1,q2,tau1,tau2"
        np.savetxt(scara_set / f"{name}.csv", rows, delimiter=",", header=head, comments="")
    text = (scara_set / "benchmark.toml").read_text().replace(".parquet", ".csv")
    more = 'robot = "scara", torque = "held", torque_delay = 0, resample = true'
    (scara_set / "benchmark.toml").write_text(text.replace('robot = "scara"', more))
    assert main(["benchmark", "arm", "--out", "found"]) == 0
    log = row_of(tmp_path / "found")["logs"][0]
    # Nine tenths of the rows of each are kept, by chance: four fifths are in both.
    assert log["samples_seen"] > 0.3 * scara_logs[0].samples


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ("fitt = []", "fit"),
        ("fit = []", "at least one log"),
        ('identify = {out = "x"}', "unknown key 'out'"),
        ('identify = {log = "x.csv"}', "unknown key 'log'"),
        ('identify = {robto = "scara"}', "unknown key 'robto' (did you mean 'robot'?)"),
        ('identify = {robot = "scara", cutoff = "fast"}', "cutoff = 'fast': must be a valid number"),
        ('identify = {robot = "scara", torque = "late"}', "torque = 'late': must be 'held', 'instantaneous' or 'averaged'"),
        ('servo = {robot = "scara"}', "give one table, [identify] or [servo]"),
        ('options = "--robot \\"scara"', "write identify = {...} instead"),
        ('held_out = ["gone.csv"]\nget = "ask them"', "gone.csv; get the data with: ask them"),
        ("free_run = -1.0", "free_run"),
        ("title = 3", "title"),
        ('published = "0.1 rad"', "published"),
        ('published = [{value = 1.0, metric = "R2", split = "", by = ""}]', "metric = 'R2': must be 'torque error'"),
    ],
)
def test_wrong_definitions_are_refused_by_name(scara_set, tmp_path, monkeypatch, capfd, change, words):
    monkeypatch.chdir(tmp_path)
    key = change.partition(" ")[0]
    kept = [line for line in (scara_set / "benchmark.toml").read_text().splitlines() if not line.startswith(f"{key} =")]
    (scara_set / "benchmark.toml").write_text("\n".join([*kept, change]) + "\n")
    assert main(["benchmark", "arm", "--out", "found"]) == 2
    said = capfd.readouterr().err
    assert words in said
    assert "Traceback" not in said


CODE = [
    'options = "--robot scara --model evil:X"',
    'options = "--robot scara --chain os:abort"',
    'options = "--robot scara --chain=evil:X"',
    'options = ["--chain", "evil:X"]',
    'options = "--robot scara"\nidentify = {robot = "scara"}',
    *(
        f'identify = {{robot = "scara", {key} = "{name}"}}'
        for key in ("model", "chain", "estimator")
        for name in ("evil:X", "evil")
    ),
    'identify = {robot = "scara", model = ["evil:X"]}',
    *(
        f'identify = {{robot = "scara", {key} = "{law}"}}'
        for key in ("friction", "add")
        for law in ("evil:X", "standard+evil:X")
    ),
    'identify = {robot = "scara", friction = ["1=evil:X"]}',
    'identify = {robot = "scara", balancer = "evil:X"}',
    'identify = {robot = "evil:X"}',
    'identify = {robot = "scara", chain_file = "chain.toml"}',
    'identify = {robot = "scara", loop = "evil:X"}',
    'servo = {robot = "evil:X", servo = "evil:X"}',
]
"""Every spelling of code that a set could try."""


@pytest.mark.parametrize("change", CODE)
def test_a_set_names_no_code(scara_set, tmp_path, monkeypatch, capfd, change):
    """A module beside the set, and on the search path, is not imported, whatever the set says."""
    monkeypatch.chdir(scara_set)
    monkeypatch.syspath_prepend(str(scara_set))
    (scara_set / "evil.py").write_text("raise SystemExit('evil ran')\n")
    (scara_set / "chain.toml").write_text('chain = "evil:X"\n')
    kept = (scara_set / "benchmark.toml").read_text().replace('identify = {robot = "scara", model = "explicit"}\n', "")
    (scara_set / "benchmark.toml").write_text(f"{kept}{change}\n")
    assert main(["benchmark", str(scara_set), "--out", str(tmp_path / "found")]) == 2
    captured = capfd.readouterr()
    assert "evil ran" not in captured.err + captured.out
    assert "evil" not in sys.modules
    assert "Traceback" not in captured.err


def test_a_set_of_before_is_told_the_line_that_replaces_its_options(scara_set, tmp_path, complaint):
    old = 'options = "--robot scara --armature all --add offset --gravity 0 0 9.81 --cutoff 3 --resample"\n'
    kept = (scara_set / "benchmark.toml").read_text().replace('identify = {robot = "scara", model = "explicit"}\n', old)
    (scara_set / "benchmark.toml").write_text(kept)
    said = complaint("benchmark", str(scara_set), "--out", str(tmp_path / "found"))
    line = 'identify = {robot = "scara", armature = "all", add = "offset", gravity = [0.0, 0.0, 9.81], '
    line += "cutoff = 3.0, resample = true}"
    assert f"write {line} instead" in said
    (scara_set / "benchmark.toml").write_text(kept.replace(old, f"{line}\n"))
    _ = read_definition(scara_set)


def test_a_row_follows_from_the_files_that_its_files_name(scara_set):
    """A robot in a subfolder, what it includes, and its meshes: another file is another row."""
    inner = scara_set / "robots" / "parts"
    inner.mkdir(parents=True)
    (scara_set / "robots" / "arm.xml").write_text(
        '<mujoco><compiler meshdir="parts"/><include file="parts/body.xml"/></mujoco>'
    )
    (inner / "body.xml").write_text('<mujoco><asset><mesh file="hand.stl"/></asset></mujoco>')
    (inner / "hand.stl").write_text("a mesh")
    text = (scara_set / "benchmark.toml").read_text().replace('robot = "scara"', 'robot = "robots/arm.xml"')
    (scara_set / "benchmark.toml").write_text(text)
    names = {path.name for path in files_of(scara_set, read_definition(scara_set))}
    assert {"arm.xml", "body.xml", "hand.stl", "one.parquet", "new.parquet", "benchmark.toml"} <= names


def test_one_set_that_fails_leaves_the_others(scara_set, tmp_path, monkeypatch, capfd):
    monkeypatch.chdir(tmp_path)
    shutil.copytree(scara_set, tmp_path / "broken")
    (tmp_path / "broken" / "one.parquet").write_bytes(b"nothing")
    assert main(["benchmark", "broken", "arm", "--out", "found"]) == 2
    captured = capfd.readouterr()
    assert "A SCARA" in captured.out
    assert "broken" in captured.err
    assert row_of(tmp_path / "found")["verdict"] == "good"
    assert json.loads((tmp_path / "found" / "summary.json").read_text())["failures"].keys() == {"broken"}
    assert "No row of broken" in (tmp_path / "found" / "report.html").read_text()


def test_folders_that_are_no_sets_are_named(tmp_path, monkeypatch, complaint):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "empty").mkdir()
    assert "empty has no benchmark.toml" in complaint("benchmark", "empty")
    assert "idbench new set ur10e" in complaint("benchmark", "ur10e")
    assert "did you mean 'panda'" in complaint("new", "set", "pandas")


def test_two_folders_of_one_name_are_refused(scara_set, tmp_path, monkeypatch, complaint):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "more").mkdir()
    shutil.copytree(scara_set, tmp_path / "more" / "arm")
    assert "one name" in complaint("benchmark", "arm", "more/arm")


@pytest.mark.parametrize("name", shipped())
def test_sets_that_ship_are_complete_but_for_their_data(name, tmp_path, monkeypatch, capfd):
    monkeypatch.chdir(tmp_path)
    assert main(["new", "set", name]) == 0
    assert "git clone" in capfd.readouterr().out
    made = read_definition(tmp_path / name)
    assert made.title
    assert made.source
    assert made.license
    ships = {path.name for path in (SHIPPED / name).iterdir() if path.is_file()}
    assert {path.name for path in (tmp_path / name).iterdir()} == ships
    assert main(["benchmark", name]) == 2
    assert "get the data with" in capfd.readouterr().err
    for path in (tmp_path / name).glob("*.py"):
        compile(path.read_text(), path.name, "exec")


@pytest.mark.thorough
def test_rows_are_the_same_on_workers(scara_set, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    shutil.copytree(scara_set, tmp_path / "second")
    assert main(["benchmark", "arm", "second", "--out", "here"]) == 0
    assert main(["benchmark", "arm", "second", "--out", "there", "--workers", "2"]) == 0
    for name in ("arm", "second"):
        one, other = row_of(tmp_path / "here", name), row_of(tmp_path / "there", name)
        times = {"seconds", "seconds_of_judging"}
        assert {k: v for k, v in one.items() if k not in times} == {k: v for k, v in other.items() if k not in times}


def test_sets_in_two_threads_read_their_own_files(scara_set, scara_logs, tmp_path):
    """A scheduler's workers have several threads, and a process is in one folder."""
    other = tmp_path / "other"
    shutil.copytree(scara_set, other)
    for name, log in zip(("one", "two", "new"), scara_logs, strict=True):
        write_log(replace(log, tau=1.5 * log.tau), other / f"{name}.parquet")
    alone = [set_row(place, tmp_path / "alone" / place.name, force=False) for place in (scara_set, other)]
    with ThreadPoolExecutor(2) as pool:
        both = list(pool.map(lambda place: set_row(place, tmp_path / "both" / place.name, force=False), (scara_set, other)))
    errors = [[row["logs"][0]["torque_error_rms"] for row in rows] for rows in (alone, both)]
    assert errors[0] == errors[1]
    assert errors[0][0] != errors[0][1]


def test_a_row_is_made_again_when_its_data_change_and_repeats_keep_the_delay(scara_set, scara_logs, tmp_path, monkeypatch):
    """Logs in a folder of the set, 10 ms late, which the fit finds."""
    monkeypatch.chdir(tmp_path)
    (scara_set / "data").mkdir()
    for name, log in zip(("one", "two", "new"), scara_logs, strict=True):
        (scara_set / f"{name}.parquet").unlink()
        late = MotionLog(log.fs, log.q[1:], log.tau[:-1], TorqueChannel("instantaneous"))
        write_log(late, scara_set / "data" / f"{name}.parquet")
    (scara_set / "benchmark.toml").write_text(
        'title = "late"\nfit = ["data/one.parquet", "data/two.parquet"]\nheld_out = ["data/new.parquet"]\n'
        'identify = {robot = "scara", model = "explicit", torque_delay = "estimate"}\nfree_run = 0.2\n'
    )
    assert main(["benchmark", "arm", "--out", "found"]) == 0
    row = row_of(tmp_path / "found")
    assert row["repeats"]["inside"] >= 6  # of eight; without the delay friction and inertias differ
    assert row["free_run"][0]["diverged"] == 0
    assert max(row["free_run"][0]["nrmse"]) < 0.1
    shutil.copy(scara_set / "data" / "one.parquet", scara_set / "data" / "new.parquet")
    assert main(["benchmark", "arm", "--out", "found"]) == 2  # held out is what is fitted


def test_tools_get_late_torques_without_loss():
    """At 10 Hz, where straight lines between samples would take a fifth of what moves at 2 Hz."""
    t = np.arange(200) / 10
    tau = np.sin(2 * np.pi * t)[:, None]
    late = MotionLog(10.0, tau, np.sin(2 * np.pi * (t + 0.05))[:, None], TorqueChannel("instantaneous", delay=0.05))
    assert np.abs(prepared(late)["tau"] - tau)[5:-5].max() < 0.01


def test_results_stay_out_of_the_set(scara_set, tmp_path, monkeypatch, capfd):
    monkeypatch.chdir(tmp_path)
    assert main(["benchmark", "arm", "--out", "."]) == 2
    capfd.readouterr()
    (tmp_path / "below").mkdir()
    monkeypatch.chdir(tmp_path / "below")
    assert main(["benchmark", "../arm/.", "--out", ".."]) == 2
    assert "choose another --out" in capfd.readouterr().err
    assert not (scara_set / "summary.json").exists()


def test_errors_over_logs_are_pooled():
    logs = [{"torque_error_rms": [1.0], "torque_rms": [10.0]}, {"torque_error_rms": [0.1], "torque_rms": [0.2]}]
    assert share({"logs": logs}, logs)[0] == pytest.approx(100 * np.sqrt(1.01 / 100.04))
