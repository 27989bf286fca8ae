"""Kept figures are what the program gives: samples of them are made anew, and differ where a source changes its numbers."""

import json
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
MADE = json.loads((ROOT / "docs" / "results" / "made.json").read_text())


@pytest.fixture(scope="module")
def remake():
    sys.path.insert(0, str(ROOT / "docs" / "build"))
    try:
        import remake
    finally:
        sys.path.pop(0)
    return remake


def test_every_kept_figure_has_its_command(remake):
    kept = {path.stem for path in (ROOT / "docs" / "results").glob("*.json")} - {"made"}
    own = {name.removesuffix("-ratios") for name in kept}
    assert own <= set(remake.commands())
    assert own | {"models"} == set(MADE)
    assert {name: one["command"] for name, one in MADE.items()} == {name: remake.commands()[name] for name in MADE}


@pytest.mark.thorough
@pytest.mark.parametrize("name", [name for name, one in MADE.items() if one["sample"]])
def test_a_sample_of_a_kept_figure_is_what_the_program_gives(remake, name):
    found = remake.sample(name)
    assert remake.changed(MADE[name]["sample"], found) == []
    assert remake.apart(name, found) is None


def test_a_number_that_changes_is_seen(remake):
    kept = {"encoder.lines 256, GLS": [0.8, 97.0, 3.5, 0.07], "OLS": [1.0]}
    assert remake.changed(kept, {**kept}) == []
    assert remake.changed({"OLS": [1.0, None]}, {"OLS": [1.0, None]}) == []
    assert remake.changed({"OLS": [1.0, None]}, {"OLS": [1.0, 2.0]}) == ["OLS"]
    assert remake.changed(kept, {**kept, "OLS": [1.03]}) == ["OLS"]
    assert remake.changed(kept, {"encoder.lines 256, GLS": [0.8, 97.0, 3.5, 0.07]}) == ["OLS"]
    assert remake.changed(kept, {**kept, "encoder.lines 256, GLS": [0.8, 100.0, 3.5, 0.07]}) == ["encoder.lines 256, GLS"]
