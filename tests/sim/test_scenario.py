"""Scenarios: every key checked, every error names key, value, what is allowed and the nearest known key; files round trip."""

import tomllib

import pytest

from idbench.sim.drives import SwitchedDrive
from idbench.sim.encoders import IncrementalEncoder
from idbench.sim.errors import ScenarioError
from idbench.sim.robot.payload import Payload
from idbench.sim.scenario.measurement import Ripple, TorqueMeasurement
from idbench.sim.scenario.scenario import Physics, Scenario, Timing
from idbench.sim.scenario.scenario_file import KINDS, from_dict, load, names, to_dict, to_toml
from idbench.sim.settings import description, fields_of, per_joint
from idbench.sim.trajectories import Quintic


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


def test_one_value_holds_for_all_joints_and_others_are_counted():
    assert per_joint((2.0,), 3, "x").tolist() == [2.0, 2.0, 2.0]
    with pytest.raises(ScenarioError, match=r"drive\.x has 2 values for 3 joints"):
        per_joint((1.0, 2.0), 3, "drive.x")
