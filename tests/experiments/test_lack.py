"""What a fit lacks, as a user sees it: a mark on sigma, a line, and what to try."""

import json

import pytest

from idbench.experiments.cli import main

pytestmark = pytest.mark.thorough


@pytest.mark.parametrize(("friction", "there"), [("standard", True), ("standard+stribeck", False)])
def test_a_stribeck_robot_with_standard_friction_is_marked(tmp_path, monkeypatch, capsys, friction, there):
    monkeypatch.chdir(tmp_path)
    main(["run", "stribeck", "--no-rerun", "--out", "run"])
    capsys.readouterr()
    log = next(path for path in (tmp_path / "run").iterdir() if path.name.startswith("log.") and path.suffix != ".toml")
    how = ["--robot", "scara", "--friction", friction, "--model", "explicit"]
    main(["identify", str(log), *how, "--no-rerun", "--out", "found"])
    shown = capsys.readouterr().out
    assert ("depends on velocity, which no parameter explains" in shown) == there
    assert ("which no parameter explains" in shown) == there
    assert ("lack of fit: none" in shown) != there
    (summary,) = (tmp_path / "found").rglob("summary*.json")
    tests = json.loads(summary.read_text())["lack_of_fit"]
    assert (tests[0]["p"] < 1e-6 and tests[0]["over"] == "velocity") == there
