"""The commands on scenarios and logs, as a user calls them."""

import re
from dataclasses import replace

import numpy as np
import pytest
import tomli_w

from idbench.experiments.cli import main
from idbench.experiments.cli.options.jobs import Identify
from idbench.experiments.results.writing import NAME as MANIFEST
from idbench.identify.files.log_file import read_log
from idbench.sim.scenario.scenario_file import from_dict, load, names, to_dict, to_toml
from idbench.sim.trajectories import RandomMoves

SHORT = RandomMoves(moves=3, rest=0.6)


def shortened(name, tmp_path):
    """Write a scenario that ships to a file, on a motion of five seconds; a payload needs no other robot."""
    path = tmp_path / f"{name}.toml"
    moves = SHORT if load(name).robot == "scara" else replace(SHORT, velocity=(2.0,), durations=(0.8, 1.6), moves=12)
    path.write_text(to_toml(replace(load(name), trajectory=moves, fs=min(load(name).fs, 250.0))))
    return path


@pytest.mark.thorough
@pytest.mark.parametrize("name", names())
def test_every_scenario_that_ships_runs(name, tmp_path, ran):
    out = tmp_path / "out"
    printed, _, summary = ran("run", shortened(name, tmp_path), "--out out")
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
    """A short closed loop as CSV."""
    out = tmp_path / "run"
    assert main(["run", str(shortened("ideal", tmp_path)), "--no-rerun", "--out", str(out)]) == 0
    assert main(["export", str(out)]) == 0
    return out / "log.csv"


def test_a_csv_is_identified_with_what_its_torque_means(csv, ran, truth, tmp_path):
    out, summary = tmp_path / "found", ran("identify", csv, "--torque held --out found").summary
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


def test_one_model_and_an_estimated_delay(csv, ran):
    printed = ran("identify", csv, "--torque held --torque-delay estimate --model explicit").out
    assert re.search(r"torque: held, delay \S+ ms, estimated from the log", printed)
    assert "power" not in printed
    first, then, *_ = printed.splitlines()
    assert first.startswith("Result: good: torques within ")
    assert re.search(r"on the last quarter of the log; sees gain errors above \S+ %$", first)
    assert then.startswith("next: ")


def rewritten(csv, change):
    lines = csv.read_text().splitlines()
    csv.write_text("\n".join(change(lines)) + "\n")


def test_a_header_may_have_spaces_and_quotes_and_velocities(csv, ran):
    rewritten(csv, lambda lines: [lines[0].replace(",", " , ") + ",qd1", *(f"{line},0" for line in lines[1:])])
    ran("identify", csv, "--torque held")


def test_the_first_lines_say_what_to_check_first_and_models_alike_are_one(csv, ran):
    """Of a log whose delay is wrong by 3 ms."""
    lines = ran("identify", csv, "--torque held --torque-delay 0.003 -v --robot scara").out.splitlines()
    assert lines[0].startswith("Result: ")
    assert re.search(r"all torques: torque acts earlier than the log says, by 3\.0\d+\(\d+\) ms", lines[1])
    assert lines[2] == "next: --torque-delay estimate"
    assert any(line.startswith("explicit: ") and line.endswith(" (implicit: the same)") for line in lines)


def test_positions_in_degrees_are_a_cause_with_its_option(csv, ran):
    def in_degrees(lines):
        rows = [[float(x) for x in line.split(",")] for line in lines[1:]]
        return [lines[0], *(",".join(f"{x * (57.29578 if 1 <= k <= 2 else 1):.9g}" for k, x in enumerate(row)) for row in rows)]

    rewritten(csv, in_degrees)
    first, why, then, *_ = ran("identify", csv, "--torque held --robot scara").out.splitlines()
    assert first.startswith("Result: poor")
    assert re.search(r"^positions are in degrees \(\d+ sigma\)$", why)
    assert then == "next: --units q=deg"


def test_a_robot_that_nobody_names_is_named(csv, ran):
    assert "no --robot was given, the shipped scara is assumed" in ran("identify", csv, "--torque held").out


def test_a_log_with_a_gap_is_resampled_by_the_command_that_is_told(csv, tmp_path, complaint, monkeypatch):
    rewritten(csv, lambda lines: [*lines[:200], *lines[201:]])
    found = complaint("identify", str(csv), "--torque", "held")
    assert "a step of 0.02 s after t = 1.98 s" in found
    monkeypatch.chdir(tmp_path)
    assert main(["resample", *found.split("idbench resample ")[1].split()]) == 0
    assert main(["identify", "uniform.parquet"]) == 0


def test_what_no_healthy_log_shows_is_said(csv, ran):
    rewritten(
        csv, lambda lines: [lines[0], *(",".join([*x[:-1], str(-float(x[-1]))]) for x in (y.split(",") for y in lines[1:]))]
    )
    printed = ran("identify", csv, "--torque held --model explicit").out
    assert "warning: Fs2 below zero in the explicit model" in printed.replace("Fv2, ", "")
    assert "nothing of tau2: are units, signs" in printed
    assert "0 is assumed" in printed


def test_a_parameter_whose_truth_is_zero_is_reported(tmp_path, ran):
    content = to_dict(replace(load("ideal"), trajectory=SHORT))
    content["friction"]["viscous"] = [0.0, 0.01]
    (tmp_path / "x.toml").write_text(tomli_w.dumps(content))
    assert ran("run x.toml --out out").summary["models"]["power"]["relative_error_percent"][1] is None


def test_the_help_of_identify_is_short_and_all_of_it_is_one_option_away(capsys):
    assert main(["identify", "--help"]) == 0
    short = re.findall(r"^\W+(?:-\w, )?(--[a-z][\w-]*)", capsys.readouterr().out, re.MULTILINE)
    assert set(short) - {"--help"} == {f"--{name.replace('_', '-')}" for name in Identify.essential if name != "log"}
    assert main(["identify", "--help-all"]) == 0
    whole = re.findall(r"^\W+(?:-\w, )?(--[a-z][\w-]*)", capsys.readouterr().out, re.MULTILINE)
    assert set(short) < set(whole)
    assert len(whole) > 35
