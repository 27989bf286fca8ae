"""Sets of servos in a benchmark: commands and positions in the place of torques."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from idbench.experiments.benchmark.definition import SHIPPED, read_definition
from idbench.experiments.cli import main
from idbench.sim.scenario.scenario_file import load, to_toml

DEFINITION = """
title = "A servo"
fit = ["fit-*.parquet"]
held_out = ["new.parquet"]
servo = {robot = "pendulum", servo = "servo.toml", friction = "coulomb"}
"""


def test_patterns_name_the_logs_that_are_there(tmp_path):
    for name in ("fit-2.parquet", "fit-1.parquet", "fit-1.txt", "new.parquet"):
        (tmp_path / name).touch()
    (tmp_path / "benchmark.toml").write_text(DEFINITION)
    definition = read_definition(tmp_path)
    assert definition.fit == ("fit-1.parquet", "fit-2.parquet")
    (tmp_path / "fit-1.parquet").unlink()
    (tmp_path / "fit-2.parquet").unlink()
    assert read_definition(tmp_path).fit == ("fit-*.parquet",)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (('held_out = ["new.parquet"]', ""), "name a second log, or held_out"),
        (('friction = "coulomb"', 'armature = "all"'), "armature"),
        (("servo = {", "servos = {"), "servos"),
        (('"fit-*.parquet"', '"other-*.parquet"'), "has no other-*.parquet"),
    ],
)
def test_what_is_wrong_with_a_set_of_servos_is_said(tmp_path, monkeypatch, capfd, change, said):
    monkeypatch.chdir(tmp_path)
    folder = tmp_path / "bench"
    folder.mkdir()
    (folder / "benchmark.toml").write_text(DEFINITION.replace(*change))
    for name in ("fit-1.parquet", "new.parquet"):
        (folder / name).touch()
    (folder / "servo.toml").write_text('model = "STS3215"\n')
    assert main(["benchmark", "bench", "--out", "found"]) != 0
    assert said in "".join(capfd.readouterr())


@pytest.mark.thorough
def test_servos_are_judged_by_positions_from_commands_alone(tmp_path, monkeypatch, capfd):
    monkeypatch.chdir(tmp_path)
    folder, plain = tmp_path / "bench", load("servo")
    folder.mkdir()
    for seed, name in enumerate(("fit-1", "new")):
        scenario = replace(plain, seed=seed, trajectory=replace(plain.trajectory, seed=seed))
        Path("one.toml").write_text(to_toml(scenario))
        assert main(["run", "one.toml", "--out", f"run{seed}", "--no-rerun"]) == 0
        (tmp_path / f"run{seed}" / "log.parquet").rename(folder / f"{name}.parquet")
    (tmp_path / "run0" / "servo.toml").rename(folder / "servo.toml")
    (folder / "benchmark.toml").write_text(DEFINITION)
    assert main(["benchmark", "bench", "--out", "found"]) == 0
    assert "from commands alone" in capfd.readouterr().out
    row = json.loads((tmp_path / "found" / "bench" / "summary.json").read_text())
    truth, found = plain.drive, row["estimate"][row["joints"][0]]
    for name, true in (("a", truth.torque_constant[0] / truth.resistance[0]), ("rate", truth.rate)):
        assert abs(found[name]["value"] - true) < 4 * found[name]["sigma"], name
    step = 2 * np.pi / truth.counts
    assert row["logs"][0]["position_error"][0] < 4 * step
    assert 0 < row["free_run"][0]["nrmse"][0] < 0.01
    assert (tmp_path / "found" / "report.html").read_text().count("A servo") >= 2


def test_the_bench_that_ships_becomes_logs(tmp_path, monkeypatch):
    """Its script, given runs as the public set has them."""
    monkeypatch.chdir(tmp_path)
    for name in ("benchmark.toml", "prepare.py"):
        (tmp_path / name).write_text((SHIPPED / "sts3215" / name).read_text())
    entry = {"timestamp": 7.5, "position": 0.25, "goal_position": 0.5, "torque_enable": True}
    for k, mass in enumerate((0.535, 0.741, 1.1682, 0.535)):
        run = {"mass": mass, "length": 0.1, "kp": 8, "trajectory": "brutal", "entries": [entry, {**entry, "timestamp": 7.51}]}
        (tmp_path / f"{k}.json").write_text(json.dumps(run))
    monkeypatch.setattr("sys.argv", ["prepare.py", "."])
    exec(compile((tmp_path / "prepare.py").read_text(), "prepare.py", "exec"), {"__name__": "__main__"})
    definition = read_definition(tmp_path)
    assert definition.fit == ("535g-100mm-kp8-brutal-1.csv", "535g-100mm-kp8-brutal-2.csv", "1168g-100mm-kp8-brutal-1.csv")
    assert definition.held_out == ("741g-100mm-kp8-brutal-1.csv",)
    t, q, command, on = np.loadtxt("741g-100mm-kp8-brutal-1.csv", delimiter=",", skiprows=1)[1]
    assert (t, q, command, on) == pytest.approx((0.01, 0.25, 0.5, 1))
