"""Wrong input to the command line that takes more than a line of refusals.toml: one line each, exit code 2, nothing written."""

import sys

import pytest
import tomli_w

from idbench.experiments.paper.table1 import SCENARIO
from idbench.sim.scenario.scenario_file import load, to_dict


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


def test_view_tells_where_there_is_no_display(out, monkeypatch, complaint):
    out.mkdir()
    (out / "recording.rrd").write_bytes(b"RRF2")
    monkeypatch.setattr(sys, "platform", "linux")
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    assert "there is no display here" in complaint("view", str(out))


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
