"""The commands on scenarios and logs, as a user calls them."""

import json
import re
from dataclasses import replace

import numpy as np
import pytest
import tomli_w

from idbench.experiments.cli import main
from idbench.experiments.cli.options.jobs import Identify
from idbench.experiments.paper import table2
from idbench.experiments.paper.attribution import imperfections
from idbench.experiments.paper.table2 import PAPER, Table2
from idbench.experiments.results.writing import NAME as MANIFEST
from idbench.identify.files.log_file import read_log
from idbench.sim.drives import AveragedDrive
from idbench.sim.scenario.scenario_file import from_dict, load, names, to_dict, to_toml
from idbench.sim.trajectories import Quintic, RandomMoves

SHORT = RandomMoves(moves=3, rest=0.6)


def shortened(name, tmp_path):
    """Write a scenario that ships to a file, on a motion of five seconds; a payload needs no other robot."""
    path = tmp_path / f"{name}.toml"
    moves = SHORT if load(name).robot == "scara" else replace(SHORT, velocity=(2.0,), durations=(0.8, 1.6), moves=12)
    path.write_text(to_toml(replace(load(name), trajectory=moves, fs=min(load(name).fs, 250.0))))
    return path


@pytest.mark.thorough
@pytest.mark.parametrize("name", names())
def test_every_scenario_that_ships_runs(name, tmp_path, capsys):
    out = tmp_path / "out"
    assert main(["run", str(shortened(name, tmp_path)), "--out", str(out)]) == 0
    printed = capsys.readouterr().out
    of_servos = load(name).controller.commanded == "position"
    first = "YYR1" if load(name).robot == "pendulum" else "ZZR1"
    assert all(word in printed for word in (first, "Fs1", "%sigma", "torque: held"))
    assert ("uv run idbench servo" in printed) == of_servos
    assert {x.name for x in out.iterdir()} - {MANIFEST} == {
        "log.parquet",
        "recording.idbench-GLS.rrd",
        "recording.rrd",
        "scenario.toml",
        *(["servo.toml", "commands.csv"] if of_servos else []),
        "summary.json",
    }
    summary = json.loads((out / "summary.json").read_text())
    assert list(summary["models"]) == ["explicit", "implicit", "power"]
    assert summary["scenario"]["name"] == name
    assert from_dict(summary["scenario"]) == load(str(out / "scenario.toml"))


def test_scenarios_are_listed_printed_and_written(tmp_path, capfd, complaint):
    assert main(["scenario"]) == 0
    listed = capfd.readouterr().out
    assert all(name in listed for name in names())
    assert main(["scenario", "table2"]) == 0
    assert "# Switching frequency [Hz]" in capfd.readouterr().out
    path = tmp_path / "mine.toml"
    assert main(["scenario", "table2", "--out", str(path)]) == 0
    assert load(str(path)) == load("table2")
    assert "exists: choose another name" in complaint("scenario", "table2", "--out", str(path))


@pytest.fixture
def csv(tmp_path):
    """A short closed loop as CSV, and its truth."""
    out = tmp_path / "run"
    assert main(["run", str(shortened("ideal", tmp_path)), "--out", str(out)]) == 0
    assert main(["export", str(out)]) == 0
    return out / "log.csv"


def test_a_csv_is_identified_with_what_its_torque_means(csv, capsys, truth, tmp_path):
    out = tmp_path / "found"
    assert main(["identify", str(csv), "--torque", "held", "--out", str(out)]) == 0
    summary = json.loads((out / "summary.json").read_text())
    assert summary["truth"] is None
    assert summary["models"]["explicit"]["relative_error_percent"] is None
    np.testing.assert_allclose(summary["models"]["power"]["estimate"], truth, rtol=1e-3)
    assert min(summary["models"]["power"]["explained_share"]) > 0.999
    assert {x.name for x in out.iterdir()} - {MANIFEST} == {
        "log.parquet",
        "recording.idbench-GLS.rrd",
        "recording.rrd",
        "report.html",
        "summary.json",
    }
    assert read_log(out / "log.parquet").torque.meaning == "held"


def test_one_model_and_an_estimated_delay(csv, capsys):
    assert main(["identify", str(csv), "--torque", "held", "--torque-delay", "estimate", "--model", "explicit"]) == 0
    printed = capsys.readouterr().out
    assert re.search(r"torque: held, delay \S+ ms, estimated from the log", printed)
    assert "power" not in printed
    first, then, *_ = printed.splitlines()
    assert first.startswith("Result: good (explicit model), torque errors of at most ")
    assert first.endswith("on the last quarter of the log")
    assert then.startswith("next: ")


def rewritten(csv, change):
    lines = csv.read_text().splitlines()
    csv.write_text("\n".join(change(lines)) + "\n")


def test_a_header_may_have_spaces_and_quotes_and_velocities(csv):
    rewritten(csv, lambda lines: [lines[0].replace(",", " , ") + ",qd1", *(f"{line},0" for line in lines[1:])])
    assert main(["identify", str(csv), "--torque", "held"]) == 0


def test_the_first_lines_say_what_to_check_first_and_models_alike_are_one(csv, capsys):
    """Of a log whose delay is wrong by 3 ms."""
    assert main(["identify", str(csv), "--torque", "held", "--torque-delay", "0.003", "-v", "--robot", "scara"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[0].startswith("Result: ")
    assert re.search(r"all torques: torque acts earlier than the log says, by 3\.0\d+\(\d+\) ms", lines[0])
    assert lines[1] == "next: --torque-delay estimate"
    assert any(line.startswith("explicit: ") and line.endswith(" (implicit: the same)") for line in lines)


def test_what_is_wrong_with_the_log_comes_before_mistakes_of_the_model(csv, capsys):
    def in_degrees(lines):
        rows = [[float(x) for x in line.split(",")] for line in lines[1:]]
        return [lines[0], *(",".join(f"{x * (57.29578 if 1 <= k <= 2 else 1):.9g}" for k, x in enumerate(row)) for row in rows)]

    rewritten(csv, in_degrees)
    assert main(["identify", str(csv), "--torque", "held", "--robot", "scara"]) == 0
    first, then, *_ = capsys.readouterr().out.splitlines()
    assert first.startswith("Result: poor")
    assert ";" not in first
    assert "--units q=deg" in then


def test_a_robot_that_nobody_names_is_named(csv, capsys):
    assert main(["identify", str(csv), "--torque", "held"]) == 0
    assert "no --robot was given, the shipped scara is assumed" in capsys.readouterr().out


def test_a_log_with_a_gap_is_resampled_by_the_command_that_is_told(csv, tmp_path, complaint, monkeypatch):
    rewritten(csv, lambda lines: [*lines[:200], *lines[201:]])
    found = complaint("identify", str(csv), "--torque", "held")
    assert "a step of 0.02 s after t = 1.98 s" in found
    monkeypatch.chdir(tmp_path)
    words = found.split("idbench resample ")[1].split()
    assert main(["resample", *words]) == 0
    assert main(["identify", "uniform.parquet"]) == 0


def test_what_no_healthy_log_shows_is_said(csv, capsys):
    rewritten(
        csv, lambda lines: [lines[0], *(",".join([*x[:-1], str(-float(x[-1]))]) for x in (y.split(",") for y in lines[1:]))]
    )
    assert main(["identify", str(csv), "--torque", "held", "--model", "explicit"]) == 0
    printed = capsys.readouterr().out
    assert "warning: Fs2 below zero in the explicit model" in printed.replace("Fv2, ", "")
    assert "nothing of tau2: are units, signs" in printed
    assert "0 is assumed" in printed


def test_a_parameter_whose_truth_is_zero_is_reported(tmp_path):
    path, out = tmp_path / "x.toml", tmp_path / "out"
    content = to_dict(replace(load("ideal"), trajectory=SHORT))
    content["friction"]["viscous"] = [0.0, 0.01]
    path.write_text(tomli_w.dumps(content))
    assert main(["run", str(path), "--out", str(out)]) == 0
    assert json.loads((out / "summary.json").read_text())["models"]["power"]["relative_error_percent"][1] is None


@pytest.mark.thorough
def test_table2_on_a_short_motion(tmp_path, capsys, monkeypatch):
    """Its own robot with an averaged drive, 12 moves: signature, rows, attribution."""
    points = RandomMoves(moves=12).plan(load("table2").nominal_robot)
    trajectory = Quintic(tuple(map(tuple, points.waypoints.tolist())), tuple(points.durations.tolist()), 3.0)
    scenario = replace(load("table2"), trajectory=trajectory, drive=AveragedDrive())
    path, out = tmp_path / "twin.toml", tmp_path / "out"
    path.write_text(to_toml(scenario))
    few = [i for i in imperfections(scenario) if i.name in ("nothing", "hold, not given", "gain error of 2 %")]
    monkeypatch.setattr("idbench.experiments.paper.attribution.imperfections", lambda _: few)
    assert main(["table2", "--scenario", str(path), "--out", str(out)]) == 0
    printed = capsys.readouterr().out
    assert "explicit model, 2 realizations" in printed
    assert "gain error of 2 %" in printed
    summary = json.loads((out / "summary.json").read_text())
    rows = {name: model["rows"] for name, model in summary["paper_processing"].items()}
    assert rows["explicit"] == rows["implicit"] == rows["power"]
    for model in summary["paper_processing"].values():
        assert model["estimate"][1] < 0  # Fv1
        assert model["estimate"][2] > 0.5  # Fs1
    np.testing.assert_allclose(
        summary["paper_processing"]["explicit"]["estimate"], summary["paper_processing"]["implicit"]["estimate"], rtol=0.05
    )
    alone = summary["attribution_percent"]
    np.testing.assert_allclose(alone["gain error of 2 %"]["explicit"], 2.0, atol=0.02)
    assert np.abs(alone["nothing"]["power"]).max() < 0.1
    assert alone["hold, not given"]["power"][1] < -100
    assert len(list(out.glob("log*.parquet"))) == 4


def test_table2_makes_the_papers_rows_on_the_motion_that_ships():
    """1600 rows each: two realizations of 800, four of 400; the scenario is checked before anything is simulated."""
    table = Table2(load(table2.SCENARIO))
    assert table.rest == 3.0
    assert sum(load("table1").trajectory.durations) == pytest.approx(40.0)
    assert {name: len(column.estimate) for name, column in PAPER.items()} == dict.fromkeys(PAPER, 8)


def test_the_help_of_identify_is_short_and_all_of_it_is_one_option_away(capsys):
    assert main(["identify", "--help"]) == 0
    short = re.findall(r"^\W+(?:-\w, )?(--[a-z][\w-]*)", capsys.readouterr().out, re.MULTILINE)
    assert set(short) - {"--help"} == {f"--{name.replace('_', '-')}" for name in Identify.essential if name != "log"}
    assert main(["identify", "--help-all"]) == 0
    whole = re.findall(r"^\W+(?:-\w, )?(--[a-z][\w-]*)", capsys.readouterr().out, re.MULTILINE)
    assert set(short) < set(whole)
    assert len(whole) > 35
