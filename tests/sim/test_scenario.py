"""Scenarios: every key checked, every error names key, value, what is allowed and the nearest known key; files round trip."""

import tomllib
from dataclasses import replace

import pytest

from idbench.sim.drives import AveragedDrive, SwitchedDrive
from idbench.sim.encoders import IncrementalEncoder
from idbench.sim.errors import ScenarioError
from idbench.sim.robot.payload import Payload
from idbench.sim.scenario.measurement import Ripple, TorqueMeasurement
from idbench.sim.scenario.scenario import Physics, Scenario, Timing
from idbench.sim.scenario.scenario_file import KINDS, from_dict, load, names, to_dict, to_toml
from idbench.sim.settings import description, fields_of, per_joint
from idbench.sim.trajectories import Quintic

MOVE = {"kind": "quintic", "waypoints": [[0.0, 0.0], [1.0, 1.0]], "durations": [2.0]}


@pytest.mark.parametrize("name", names())
def test_what_ships_survives_its_file(name):
    shipped = load(name)
    assert shipped.name == name
    assert from_dict(tomllib.loads(to_toml(shipped))) == shipped
    assert from_dict(to_dict(shipped)) == shipped


def test_settings_made_in_python_survive_a_file(tmp_path):
    made = Scenario(
        name="made",
        origin='with "quotes"',
        trajectory=Quintic(((0, 0), (1, 1)), (2,)),
        fs=1000,
        start=(0.1, 0.2),
        drive=SwitchedDrive(current_limit=(3.0, 1.0), dead_time=1e-6),
        encoder=IncrementalEncoder(lines=(1000, 2000), noise=1e-5),
    )
    path = tmp_path / "made.toml"
    path.write_text(to_toml(made))
    assert load(str(path)) == made


def test_every_setting_is_described():
    """Nothing that a scenario explains is left without words."""
    plugins = [table[name] for table in KINDS.values() for name in table.builtin]
    seen = set()
    for cls in (Scenario, Timing, Physics, Payload, Ripple, TorqueMeasurement, *plugins):
        for key in fields_of(cls):
            assert len(description(cls, key)) > 3, f"{cls.__name__}.{key}"
            seen.add(f"{cls.__name__}.{key}")
    assert len(seen) > 70


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"drve": 1}, r"unknown key 'drve' \(did you mean 'drive'\?\); known: name, trajectory"),
        ({"drive": {"kind": "averaged", "bandwith": 3}}, r"unknown key 'drive.bandwith' \(did you mean 'bandwidth'\?\)"),
        ({"drive": {"kind": "averagd"}}, r"drive.kind = 'averagd' is unknown \(did you mean 'averaged'\?\); known: ideal"),
        ({"drive": {"bandwidth": 3.0}}, "key 'drive.kind' is missing; known: ideal, averaged, switched"),
        ({"drive": "averaged"}, "drive = 'averaged' must be a table with a kind: ideal, averaged, switched"),
        ({"fs": "fast"}, r"fs = 'fast': must be a valid number \(Sampling frequency"),
        ({"fs": 0}, "fs = 0: must be greater than 0"),
        ({"fs": True}, "fs = True: must be a valid number"),
        ({"fs": float("nan")}, "fs = nan: must be a finite number"),
        ({"seed": 1.5}, "seed = 1.5: must be a valid integer"),
        ({"timing": 3}, "timing = 3: must be"),
        ({"timing": {"delay": 2.0}}, r"timing: delay = 2 s must be below 1 s"),
        ({"physics": {"integrator": "rk4"}}, "physics.integrator = 'rk4': must be 'RK4', 'implicitfast'"),
        ({"payload": {"position": [1.0, 2.0]}}, r"key 'payload.position\[2\]' is missing: Centre of mass"),
        ({"encoder": {"kind": "incremental", "lines": [5, -2]}}, r"encoder.lines\[1\] = -2: must be greater"),
        ({"drive": {"kind": "switched", "dead_time": 1e-3}}, r"drive: dead_time = 0.001 s must be below a tenth"),
        ({"drive": {"kind": "switched", "bandwidth": 2e3}}, r"bandwidth = 2000 Hz must be at most a fifth of pwm"),
        ({"ripple": {"commutation": 0.6, "commutation_harmonics": [1.0, 1.0]}}, "must stay below the torque constant"),
        ({"trajectory": {**MOVE, "durations": [1.0, 2.0]}}, "2 waypoints need 1 durations, not 2"),
        ({"trajectory": {**MOVE, "waypoints": [[0.0, 0.0], [1.0]]}}, "waypoints must all have the same number of joints"),
        ({"trajectory": {**MOVE, "rest": -1.0}}, r"trajectory.rest = -1.0: must be greater than or equal to 0"),
        ({"trajectory": {"kind": "random", "durations": [2.0, 1.0]}}, "the shortest is above the longest"),
        ({"trajectory": "tabel1"}, r"no scenario 'tabel1' \(did you mean 'table1'\?\)"),
        ({"name": "../x"}, r"name = '../x': must|name = '../x': String should match"),
        ({"trajectory": "ideal"}, "that scenario has none of its own; name 'brisk'"),
        ({"drive": {"kind": ["a"]}}, r"drive.kind = \['a'\] is unknown"),
        ({"ripple": {"cogging_harmonics": []}}, "ripple.cogging_harmonics"),
        ({"ripple": {"cogging_harmonics": [1.0, 2.0]}}, "cogging_harmonics have no effect without cogging"),
        ({"torque": {"cutoff": 50.0}}, "cutoff = 50 Hz needs source = 'current'"),
        ({"name": 3, "fs": -1.0}, r"name = 3: must be a valid string .*; fs = -1.0: must be greater"),
    ],
)
def test_what_is_wrong_is_named(change, message):
    with pytest.raises(ScenarioError, match=message):
        from_dict({"name": "x", "trajectory": MOVE, **change})


def test_a_missing_key_is_named_with_what_it_is():
    with pytest.raises(ScenarioError, match="key 'trajectory' is missing: Where the joints shall go"):
        from_dict({"name": "x"})


def test_python_gets_the_same_errors():
    with pytest.raises(ScenarioError, match=r"delay = -1: must be greater than or equal to 0 \(Computing delay"):
        Timing(delay=-1)
    with pytest.raises(ScenarioError, match=r"unknown key 'dely' \(did you mean 'delay'\?\)"):
        Timing(dely=0.1)
    with pytest.raises(ScenarioError, match="must be greater than 0"):
        replace(AveragedDrive(), bandwidth=0)


def test_one_value_holds_for_all_joints_and_others_are_counted():
    assert per_joint((2.0,), 3, "x").tolist() == [2.0, 2.0, 2.0]
    with pytest.raises(ScenarioError, match=r"drive\.x has 2 values for 3 joints"):
        per_joint((1.0, 2.0), 3, "drive.x")


def test_unreadable_files_are_refused(tmp_path):
    with pytest.raises(ScenarioError, match=r"cannot read scenario .*nowhere\.toml: No such file"):
        load(str(tmp_path / "nowhere.toml"))
    (tmp_path / "bad.toml").write_text("fs = = 3")
    with pytest.raises(ScenarioError, match=r"cannot read scenario .*bad\.toml"):
        load(str(tmp_path / "bad.toml"))
    (tmp_path / "list.toml").write_text("name = 'x'\n")
    with pytest.raises(ScenarioError, match=r"scenario .*list\.toml: key 'trajectory' is missing"):
        load(str(tmp_path / "list.toml"))
