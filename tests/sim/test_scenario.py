import pytest
import tomli_w

from sim.errors import ScenarioError
from sim.scenario import Scenario

GOOD = {"name": "x", "robot": "scara", "fs": 100.0, "rest": 1.0, "waypoints": [[0.0, 0.0], [1.0, 1.0]], "durations": [2.0]}


def write(tmp_path, **changes):
    path = tmp_path / "scenario.toml"
    path.write_text(tomli_w.dumps({k: v for k, v in {**GOOD, **changes}.items() if v is not None}))
    return path


def test_a_scenario_survives_its_file(tmp_path):
    scenario = Scenario.load(write(tmp_path, seed=7, origin="by hand"))
    assert Scenario.from_dict(scenario.to_dict()) == scenario
    assert scenario.seed == 7
    assert scenario.trajectory.duration == pytest.approx(4.0)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"speed": 3}, "unknown key 'speed'; known: durations, fs"),
        ({"fs": None}, "key 'fs' is missing"),
        ({"fs": "fast"}, "could not convert string to float: 'fast'"),
        ({"fs": 0}, r"fs = 0\.0 must be a finite number above 0"),
        ({"rest": -1.0}, r"rest = -1\.0 must be"),
        ({"waypoints": [0.0, 1.0]}, "not iterable"),
        ({"durations": [1.0, 2.0]}, "2 waypoints need 1 durations, not 2"),
        ({"waypoints": [[0.0, 0.0], [1.0]]}, "waypoints"),
    ],
)
def test_wrong_files_are_refused(tmp_path, changes, message):
    with pytest.raises(ScenarioError, match=message):
        Scenario.load(write(tmp_path, **changes))


def test_unreadable_files_are_refused(tmp_path):
    with pytest.raises(ScenarioError, match="cannot read scenario"):
        Scenario.load(tmp_path / "nowhere.toml")
    (tmp_path / "bad.toml").write_text("fs = = 3")
    with pytest.raises(ScenarioError, match=r"cannot read scenario .*bad\.toml"):
        Scenario.load(tmp_path / "bad.toml")
