"""What authors begin with runs as it is; a plug-in that breaks its contract is reported where."""

import csv
import subprocess
import sys
import tomllib

import pytest

from idbench.experiments.cli import main
from idbench.experiments.starters.starters import KINDS


@pytest.fixture
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize("kind", KINDS)
def test_a_plugin_is_begun_that_keeps_its_contract(kind, here, monkeypatch, capsys):
    assert main(["new", "plugin", f"begun-{kind}", "--kind", kind]) == 0
    package = here / f"begun-{kind}"
    project = tomllib.loads((package / "pyproject.toml").read_text())
    ((point, entries),) = project["project"]["entry-points"].items()
    assert point == f"idbench.{KINDS[kind].point}"
    monkeypatch.syspath_prepend(package)
    capsys.readouterr()
    assert main(["check", entries[f"begun-{kind}"]]) == 0
    assert f"of the {KINDS[kind].point}" in capsys.readouterr().out


@pytest.mark.thorough
def test_its_own_test_passes(here):
    assert main(["new", "plugin", "begun"]) == 0
    words = ["-m", "pytest", "-q", "-p", "no:cacheprovider", "-p", "no:xdist", "-c", "pyproject.toml", "--rootdir", "."]
    alone = {"PYTHONPATH": ".", "PATH": ""}
    command = [sys.executable, *words]
    done = subprocess.run(command, cwd=here / "begun", env=alone, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "3 passed" in done.stdout


@pytest.mark.thorough
def test_a_scenario_and_a_study_are_begun_that_run(ran):
    ran("new scenario mine --like quantization")
    assert "Scenario mine" in ran("run mine.toml --no-rerun").out
    ran("new study asked")
    assert "How much noise of the torque can asked bear?" in ran("study asked.toml --seeds 2 --no-rerun").out


BROKEN = '''
from dataclasses import dataclass
import numpy as np
from idbench.identify import AbstractFriction

@dataclass(frozen=True)
class Half(AbstractFriction):
    """Drag whose dissipation is half of its power."""

    symbol = "Fh"
    unit = "N m"

    def force(self, q, qd):
        return np.abs(qd) * qd

    def dissipation(self, state):
        return {at: x / 2 for at, x in super().dissipation(state).items()}
'''


def test_a_broken_contract_is_told(here, monkeypatch, capsys):
    (here / "halved.py").write_text(BROKEN)
    monkeypatch.syspath_prepend(here)
    assert main(["check", "halved:Half"]) == 2
    printed, told = capsys.readouterr()
    assert "no   Explicit columns are d/dt momentum + remainder" in printed
    assert "the power of Fh1 is off by up to" in printed
    assert "violates 1 of 3 parts of its contract" in told


def test_alone_it_says_what_there_is_to_do_in_ten_lines(capsys):
    assert main([]) == 0
    assert len([line for line in capsys.readouterr().out.splitlines() if line.strip()]) <= 10


@pytest.mark.thorough
def test_an_example_is_an_arm_with_two_logs_that_agree(here, idbench, ran):
    """As README types it: one is fitted, the other validates; a folder that is there stays as it is."""
    assert "idbench identify mine/log.csv --robot mine/arm.xml" in ran("new example mine").out
    assert sorted(path.name for path in (here / "mine").iterdir()) == ["arm.xml", "log.csv", "second.csv", "truth.csv"]
    words = "--robot mine/arm.xml --torque held --torque-delay estimate --validate mine/second.csv"
    first, *lines = ran("identify mine/log.csv", words).out.splitlines()
    assert first.startswith("Result: good: torques within ")
    with (here / "mine" / "truth.csv").open() as file:
        truth = {row["parameter"]: float(row["value"]) for row in csv.DictReader(file)}
    found = {line.split()[0]: line.split()[1] for line in lines if line.split()[:1] and line.split()[0] in truth}
    assert found.keys() == truth.keys()
    for name, text in found.items():
        value, error = text.rstrip(")").split("(")
        sigma = int(error) * 10.0 ** -len(value.partition(".")[2])
        assert abs(float(value) - truth[name]) < 4 * sigma, name
    code, _, err = idbench("new", "example", "mine")
    assert (code, "mine exists" in err) == (2, True)
