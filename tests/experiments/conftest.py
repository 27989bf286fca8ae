"""What the tests of the command line share."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
from jsonschema import Draft202012Validator

import idbench as package
from idbench.experiments.cli import main
from idbench.identify import MotionLog
from idbench.identify.files.log_file import read_log, write_log
from idbench.sim.robot.inverse_dynamics import inverse_dynamics
from idbench.sim.robot.robot import Robot
from idbench.sim.scenario.scenario_file import load, to_toml


@pytest.fixture
def out(tmp_path):
    return tmp_path / "results"


@pytest.fixture
def complaint(capfd):
    """Run the command line on wrong input; return its one line of complaint."""

    def run(*args):
        capfd.readouterr()
        assert main(list(args)) == 2
        lines = capfd.readouterr().err.strip().splitlines()
        assert len(lines) == 1
        assert lines[0].startswith("idbench: ")
        return lines[0]

    return run


@pytest.fixture
def idbench(capsys, monkeypatch, tmp_path):
    """Run a command in an empty folder; return its code, what it printed, and its complaint."""
    monkeypatch.chdir(tmp_path)

    def run(*words):
        code = main([str(word) for word in words])
        out, err = capsys.readouterr()
        return code, out, err

    return run


SCHEMA = json.loads((Path(package.experiments.__file__).parent / "results" / "summary.schema.json").read_text())
SUMMARIES = Draft202012Validator(SCHEMA)


class Ran(NamedTuple):
    """What a command printed, and the summary in its --out."""

    out: str
    err: str
    summary: dict[str, Any] | None


@pytest.fixture
def ran(idbench):
    """Run a command that succeeds in an empty folder, its words in texts and paths."""

    def run(*words):
        words = [part for word in words for part in (word.split() if isinstance(word, str) else [word])]
        code, out, err = idbench(*words)
        assert code == 0, err
        path = Path(words[words.index("--out") + 1], "summary.json") if "--out" in words else Path("none")
        summary = json.loads(path.read_text()) if path.exists() else None
        if summary is not None:
            SUMMARIES.validate(summary)
        return Ran(out, err, summary)

    return run


@pytest.fixture
def changed(logs, tmp_path):
    """Write the first log with positions and torques changed."""

    def write(q=lambda q: q, tau=lambda tau: tau, name="changed.parquet"):
        log = read_log(logs / "first.parquet")
        write_log(MotionLog(log.fs, q(log.q), tau(log.tau), log.torque), tmp_path / name)
        return tmp_path / name

    return write


ARM = """
<mujoco><worldbody><geom type="plane" size="2 2 0.1"/>
  <body name="a" pos="0 0 0.5"><joint name="turn" axis="0 0 1"/><geom size="0.1" pos="0.1 0 0"/>
    <body name="b" pos="0.1 0 0"><joint name="reach" type="slide" axis="1 0 0" range="0 0.4" damping="3"/><geom size="0.1"/>
    </body></body></worldbody></mujoco>
"""
"""A hinge without range, a short slide, bodies that overlap each other and a floor, no motors."""


@pytest.fixture
def arm(tmp_path):
    (tmp_path / "arm.xml").write_text(ARM)
    arm = load("arm")
    for name, moves, seed in (("first", 16, 0), ("second", 8, 3)):
        trajectory = replace(arm.trajectory, moves=moves, seed=seed)
        (tmp_path / f"{name}.toml").write_text(to_toml(replace(arm, name=name, fs=250.0, trajectory=trajectory)))
    return tmp_path / "arm.xml"


@pytest.fixture(scope="session")
def four_joints(tmp_path_factory):
    """A folder with a log of four joints, log.csv, and their robot's file, arm.xml."""
    folder, body, end = tmp_path_factory.mktemp("many"), "", ""
    for j, axis in enumerate(("0 0 1", "0 1 0", "0 1 0", "1 0 0")):
        body += f'<body pos="0.3 0 0"><joint name="j{j}" axis="{axis}" damping="0.1"/><geom size="0.1" pos="0.1 0 0.05"/>'
        end += "</body>"
    (folder / "arm.xml").write_text(f"<mujoco><worldbody>{body}{end}</worldbody></mujoco>")
    t, rng = np.arange(0, 12, 0.01), np.random.default_rng(0)
    w, a = 2 * np.pi * np.array([0.3, 0.7, 1.1])[:, None, None], rng.uniform(-0.5, 0.5, (3, 1, 4))
    turned = w * t[:, None] + rng.uniform(0, 6, (3, 1, 4))
    q, qd, qdd = (np.sum(x, axis=0) for x in (a * np.sin(turned), a * w * np.cos(turned), -a * w**2 * np.sin(turned)))
    tau = inverse_dynamics(Robot.load(str(folder / "arm.xml")), q, qd, qdd) + 0.1 * rng.standard_normal(q.shape)
    heads = ",".join(["t", *(f"q{j}" for j in range(1, 5)), *(f"tau{j}" for j in range(1, 5))])
    np.savetxt(folder / "log.csv", np.column_stack([t, q, tau]), delimiter=",", header=heads, comments="")
    return folder


@pytest.fixture(scope="session")
def series():
    """Return a function that makes q, qd and qdd of Fourier series within ranges and speeds, shape (time, joint) each."""

    def made(rng, t, ranges, fast):
        n = len(fast)
        w = (2 * np.pi * 0.1 * np.arange(1, 7) + rng.uniform(0, 0.05, (n, 6)))[..., None]
        a, b = rng.normal(size=(2, n, 6))[..., None]
        s, c = np.sin(w * t), np.cos(w * t)
        q, qd, qdd = (np.sum(x, axis=1).T for x in (a * s + b * c, w * (a * c - b * s), -w * w * (a * s + b * c)))
        middle, half = (q.max(axis=0) + q.min(axis=0)) / 2, np.ptp(q, axis=0) / 2
        low, high = ranges
        size = np.minimum(0.8 * (high - low) / 2 / half, 0.8 * fast / np.abs(qd).max(axis=0))
        return (low + high) / 2 + size * (q - middle), size * qd, size * qdd

    return made


@pytest.fixture
def few_moves(tmp_path):
    """Return the file of scenario arm with a few moves: where joints turn twice round, forty take five minutes."""
    arm = load("arm")
    path = tmp_path / "arm.toml"
    path.write_text(to_toml(replace(arm, trajectory=replace(arm.trajectory, moves=8))))
    return path
