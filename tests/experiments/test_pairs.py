"""Each option of identify with each other, on a robot of two joints and on one of six: it works, or says in a line why not."""

import re
from dataclasses import replace

import covertable
import pytest

from idbench.experiments.cli import main
from idbench.identify.files.log_file import write_log
from idbench.sim.engine.simulation import simulate
from idbench.sim.scenario.scenario_file import load, to_toml
from idbench.sim.trajectories import RandomMoves

pytestmark = pytest.mark.thorough

NONE = ""
"""An option that is not given."""

OPTIONS = {
    "chain": [NONE, "--chain paper", "--chain-file chain.toml"],
    "cutoff": [NONE, "--cutoff 8"],
    "mask-speed": [NONE, "--mask-speed 0.05"],
    "model": [NONE, "--model explicit", "--model power"],
    "estimator": ["--estimator WLS", "--estimator OLS", NONE, "--estimator IV"],
    "start": [NONE, "--start file"],
    "loop": [NONE, "--loop loop.toml"],
    "prior": [NONE, "--prior file", "--prior file:20% Fs2=0.1:10%"],
    "armature": [NONE, "--armature all", "--armature none"],
    "add": [NONE, "--add offset"],
    "without": [NONE, "--without Fs2"],
    "friction": [NONE, "--friction auto", "--friction standard+stribeck", "--friction 1=standard+load", "--friction none"],
    "delay": ["--torque-delay 0.0005", "--torque-delay estimate", NONE],
    "unwrap": [NONE, "--unwrap"],
    "resample": [NONE, "--resample"],
    "gain": [NONE, "--gain 1.0"],
    "coupling": [NONE, "--coupling m=joint1+joint2"],
    "gravity": [NONE, "--gravity 0 0 -9.81"],
    "validate": [NONE, "--validate second.csv"],
    "write": [NONE, "--write arm.json", "--write arm.py", "--write arm.urdf", "--write arm.xml"],
    "out": [NONE, "--out found"],
    "rerun": ["--no-rerun", NONE],
    "json": [NONE, "--json"],
    "label": [NONE, "--label mine"],
    "logs": ["first.csv", "first.csv third.csv"],
}
"""Options of identify, with values of each."""

PAIRS = covertable.make(OPTIONS, strength=2)
"""Rows in which any two values of two options stand together at least once."""


def named(row, complaint):
    """Return the options that a complaint names: by their names, also those that are missing, or by what was given."""
    known = {name: {*(word for value in values for word in value.split()[:1])} for name, values in OPTIONS.items()}
    asked = {name: {*row[name].split()} - {"--robot", "scara", "held"} for name in OPTIONS}
    words = {name: (known[name] | asked[name]) - {""} for name in OPTIONS}
    return {name for name in OPTIONS if any(re.search(rf"(?<![\w-]){re.escape(w)}(?![\w-])", complaint) for w in words[name])}


@pytest.fixture(scope="module", params=["scara", "puma560"])
def folder(request, tmp_path_factory):
    """Three short logs of a robot, and the scenario in which they were recorded."""
    folder, base = tmp_path_factory.mktemp(request.param), load("arm")
    (folder / "chain.toml").write_text('chain = "idbench"\n[operator]\ncutoff = 6.0\n')
    for name, moves, seed in (("first", 6, 0), ("second", 4, 3), ("third", 5, 7)):
        trajectory = RandomMoves(moves=moves, seed=seed, velocity=(2.0,), durations=(0.8, 1.6))
        scenario = replace(base, robot=request.param, fs=200.0, trajectory=trajectory, name=name)
        write_log(simulate(scenario).alone(), folder / f"{name}.csv")
        (folder / ("loop.toml" if name == "first" else f"{name}.toml")).write_text(to_toml(scenario))
    for name in ("second", "third"):
        (folder / f"{name}.toml").rename(folder / f"scenario-{name}.toml")
    return request.param, folder


@pytest.mark.parametrize("number", range(len(PAIRS)))
def test_any_two_options_work_together_or_say_why_not(folder, number, tmp_path, monkeypatch, capfd):
    robot, logs = folder
    for path in logs.iterdir():
        (tmp_path / path.name).write_bytes(path.read_bytes())
    monkeypatch.chdir(tmp_path)
    row = PAIRS[number]
    words = ["identify", *row["logs"].split(), "--robot", robot, "--torque", "held"]
    words += [word for name, option in row.items() if name != "logs" for word in option.split()]
    code = main(words)
    out, err = capfd.readouterr()
    complaints = [line for line in err.splitlines() if line.startswith("idbench: ")]
    assert "a fault of idbench" not in err, words
    assert "Traceback" not in out + err, words
    assert (code, len(complaints)) in ((0, 0), (2, 1)), (words, err)
    if code:
        alone = complaints[0].startswith("idbench: --write")  # a file that cannot be written is no matter of two options
        assert len(named(row, complaints[0])) > 1 - alone, (words, complaints)
    else:
        targets = [option.split()[1] for option in row.values() if option.startswith(("--write", "--out"))]
        assert all((tmp_path / target).exists() for target in targets), words
