"""Wrong input to the command line: one line each, exit code 2, nothing written."""

import sys

import pytest
import tomli_w

from idbench.experiments.cli import main
from idbench.experiments.paper.table1 import SCENARIO
from idbench.sim.scenario.scenario_file import load, to_dict


def test_an_unknown_chain_lists_the_known_and_leaves_nothing(out, complaint):
    line = complaint("table1", "--out", str(out), "--chain", "papre")
    assert "no 'papre' among the chains (did you mean 'paper'?); known: paper, paper_masked, idbench" in line
    assert not out.exists()
    assert not list(out.parent.iterdir())


def test_an_output_folder_that_cannot_be_written_is_told(tmp_path, complaint):
    (tmp_path / "file").write_text("precious")
    assert "is a file, not a folder" in complaint("table1", "--out", str(tmp_path / "file"))
    assert "cannot write to" in complaint("table1", "--out", str(tmp_path / "file" / "below"))
    assert (tmp_path / "file").read_text() == "precious"


@pytest.mark.parametrize(
    ("args", "message"),
    [
        (["table1", "--seed", "-1"], "seed = -1 must be 0 or a positive whole number"),
        (["excite", "scara", "--prior", "file"], "--prior is for logs: a motion is designed for what it shows by itself"),
        (["search", "--seed", "-1"], "seed = -1 must be 0 or a positive whole number"),
        (["table1", "--out", "a" * 300], "File name too long"),
        (["table1", "--seed", "1", "--scenario", "x.toml"], "name two trajectories: give one"),
        (["table1", "--scenario", "nowhere.toml"], "cannot read scenario nowhere.toml"),
        (["view", "README.md"], "there is no recording README.md"),
        (
            ["identify", "a.csv", "--validate", "b.csv", "--validate=c.csv"],
            "give it once, and all its values if it takes several: --validate b.csv c.csv",
        ),
        (["run", "ideal", "--torque_delay", "1", "--torque-delay", "2"], "--torque-delay is given twice"),
    ],
)
def test_more_wrong_input_is_one_line(args, message, tmp_path, monkeypatch, complaint):
    monkeypatch.chdir(tmp_path)
    assert message in complaint(*args)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"waypoints": [[0.0], [1.0], [0.0]], "durations": [1.0, 1.0]}, "the trajectory moves 1 joints, robot 'scara' has 2"),
        (
            {"waypoints": [[0.0, 0.0], [4.0, 1.0]], "durations": [1.0]},
            "joint1 would move from 0 to 4 rad, its range is -2.4 to 2.4",
        ),
        ({"durations": [1.0]}, "23 waypoints need 22 durations, not 1"),
        ({"fs": 1e9}, "fs = 1e+09 Hz makes 4.6e+10 samples of this motion; 1 to 1e+08 are allowed"),
        ({"rest": 1.0}, "rest = 1 s is shorter than the 2.81 s that chain paper looks: raise it"),
        ({"robot": "scora"}, "no robot 'scora'; known: horn, panda, pendulum, puma560, scara, servo_arm, two_link"),
    ],
)
def test_scenarios_that_make_no_sense_are_one_line(changes, message, tmp_path, complaint):
    path = tmp_path / "scenario.toml"
    content = to_dict(load(SCENARIO))
    for key, value in changes.items():
        place = content["trajectory"] if key in content["trajectory"] else content
        place[key] = value
    path.write_text(tomli_w.dumps(content))
    assert message in complaint("table1", "--scenario", str(path), "--out", str(tmp_path / "out"))
    assert list(tmp_path.iterdir()) == [path]


def test_a_folder_in_the_place_of_a_file_stops_all(out, complaint):
    (out / "recording.rrd").mkdir(parents=True)
    assert "holds recording.rrd, not written by idbench" in complaint("table1", "--out", str(out))
    assert [path.name for path in out.iterdir()] == ["recording.rrd"]


def test_view_tells_where_there_is_no_display(out, monkeypatch, complaint):
    out.mkdir()
    (out / "recording.rrd").write_bytes(b"RRF2")
    monkeypatch.setattr(sys, "platform", "linux")
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    assert "there is no display here" in complaint("view", str(out))


def test_search_says_where_it_cannot_write(tmp_path, complaint):
    assert "there is no folder" in complaint("search", "--seed", "5", "--out", str(tmp_path / "nowhere" / "found.toml"))


def test_view_needs_a_recording(tmp_path, complaint):
    assert "there is no recording" in complaint("view", str(tmp_path))


def test_wrong_words_exit_with_2(capfd):
    assert main(["tabel1"]) == 2
    assert capfd.readouterr().err.startswith("idbench: no command 'tabel1' (did you mean 'table1'?); known: ")


def test_names_that_look_like_nothing_are_not_halved_and_a_layout_is_written_to_correct(tmp_path, complaint):
    """Six currents are not three positions and three torques."""
    rows = "\n".join(f"{0.01 * k},{','.join(str(0.1 * (k + j)) for j in range(6))}" for k in range(20))
    (tmp_path / "cur.csv").write_text(f"t,{','.join(f'i_j{j + 1}' for j in range(6))}\n{rows}\n")
    found = complaint("log", str(tmp_path / "cur.csv"), "--write")
    assert "nothing in" in found
    assert "looks like positions and torques or currents" in found
    text = (tmp_path / "cur.toml").read_text()
    assert 'columns = "t"' in text
    assert text.count('# of: "t", "i_j1"') == 2
