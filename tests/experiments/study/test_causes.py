"""A study that asks from which size on faults are named."""

import json

import pytest

from idbench.experiments.cli import main

STUDY = """
name = "named"
question = "Which gains are named?"
scenario = "ideal"
seeds = 2
models = ["explicit"]
causes = true

[settings]
robot = "two_link"
fault = [{ kind = "gain", joint = "elbow", size = 0.2 }]
torque.noise = [0.073, 0.011]

[settings.trajectory]
kind = "random"
moves = 8
durations = [1.3, 1.3]
velocity = 2.0

[settings.controller]
kind = "computed_torque"

[[axes]]
field = "severity"
values = [0.001, 1.0]
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    path = tmp_path_factory.mktemp("causes")
    (path / "named.toml").write_text(STUDY)
    assert not main(["study", str(path / "named.toml"), "--out", str(path / "out"), "--no-rerun"])
    return path / "out"


@pytest.mark.thorough
def test_a_gain_of_a_fifth_is_named_and_one_of_a_fiftieth_of_a_per_cent_is_not(folder):
    summary = json.loads((folder / "summary.json").read_text())
    assert [(cell["settings"]["severity"], cell["named"], cell["misnamed"]) for cell in summary["cells"]] == [
        (0.001, 0.0, 0.0),
        (1.0, 1.0, 0.0),
    ]
    assert "from 1 on: the fault" in summary["answer"]
    assert "runs whose fault is named" in (folder / "report.html").read_text()


@pytest.mark.thorough
def test_a_run_of_it_comes_again_with_what_was_named(folder, tmp_path, capsys):
    assert not main(["run", "--from", str(folder), "--index", "2", "--out", str(tmp_path / "again"), "--no-rerun"])
    assert "bit for bit" in "".join(capsys.readouterr())


def test_a_size_that_makes_no_sense_is_refused_with_its_number(tmp_path, capsys):
    (tmp_path / "wrong.toml").write_text(
        STUDY.replace('kind = "gain", joint = "elbow", size = 0.2', 'kind = "rate", size = 2.0').replace("1.0]", "5.0]")
    )
    assert main(["study", str(tmp_path / "wrong.toml"), "--out", str(tmp_path / "out")])
    assert "size = 10" in capsys.readouterr().err
