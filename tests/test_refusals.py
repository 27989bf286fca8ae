"""What is refused: each row of refusals.toml is one line that names the value and the way out, and nothing is written."""

import importlib
import shlex
import shutil
import tomllib
from pathlib import Path

import numpy as np
import pytest

import idbench
from idbench.experiments.cli import main
from idbench.identify import MotionLog, TorqueChannel
from idbench.identify.files.log_file import read_log, write_log
from idbench.sim.robot.robot import Robot

TABLE = tomllib.loads(Path(__file__).with_name("refusals.toml").read_text())

Q, HELD = np.zeros((100, 2)), TorqueChannel("held")
"""Positions, or torques, and what torques mean, in many rows."""

OURS = idbench.ExperimentError, idbench.IdentificationError, idbench.BenchError
"""Errors that a caller can tell from mistakes of the program."""


@pytest.fixture
def scara_log(log):
    """log.csv, which does not say what torques mean, and log.parquet: 15 s of the SCARA."""
    part = log.part(0, 1500)
    write_log(part, Path("log.csv"))
    write_log(MotionLog(part.fs, part.q, part.tau, part.torque), Path("log.parquet"))


@pytest.fixture
def puma_logs(logs):
    """first.parquet and second.parquet: motions of the PUMA; part.parquet, a stretch of the first; arm.xml, its robot."""
    for name in ("first", "second"):
        shutil.copy(logs / f"{name}.parquet", f"{name}.parquet")
    write_log(read_log(Path("first.parquet")).part(500, 3000), Path("part.parquet"))
    Path("arm.xml").write_text(Robot.path("puma560").read_text())


def cases():
    """Yield every row with its group, and the parts that its line must have."""
    for name, group in TABLE.items():
        marks = [pytest.mark.thorough] if group.get("thorough") else []
        for hole, told in group["refused"].items():
            parts = [told] if isinstance(told, str) else list(told)
            if "raises" in group and not parts[0].endswith("Error: "):
                parts.insert(0, f"{group['raises']}: ")
            yield pytest.param(group, hole, parts, marks=marks, id=f"{name}: {hole}")


def written():
    """Return all files of the folder that we are in, with their contents."""
    return {path: path.read_bytes() if path.is_file() else None for path in Path().rglob("*")}


def of_command(words, capfd):
    """Run a command that must be refused; return its complaint."""
    capfd.readouterr()
    assert main(shlex.split(words)) == 2
    out, err = capfd.readouterr()
    assert out == ""
    assert err.startswith("idbench: ")
    return err.strip()


def of_call(group, text, fixtures):
    """Evaluate what must be refused, with the names of some modules; return the error's class and message."""
    names = {"np": np, "Path": Path, "idbench": idbench, "tomllib": tomllib, "Q": Q, "HELD": HELD, **fixtures}
    for module in ("idbench.identify", *group.get("names", ())):
        names |= vars(importlib.import_module(module))
    for name, value in group.get("let", {}).items():
        names[name] = eval(value, names)
    with pytest.raises(OURS) as refused:
        eval(text, names)
    return f"{type(refused.value).__name__}: {refused.value}"


@pytest.mark.parametrize(("group", "hole", "parts"), list(cases()))
def test_it_is_refused(group, hole, parts, request, tmp_path, monkeypatch, capfd):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("idbench.experiments.results.page.EVERY", 1e9)  # no progress, which a busy machine shows
    fixtures = {name: request.getfixturevalue(name) for name in group.get("needs", ())}
    for name, text in group.get("files", {}).items():
        path = Path(name.replace("{}", hole))
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text.replace("{}", hole))
    if edited := group.get("edit"):
        lines = eval(hole, {"lines": Path(edited).read_text().splitlines()})
        Path(edited).write_text("\n".join(lines) + "\n")
    before = written()
    if call := group.get("call"):
        told = [of_call(group, call.replace("{}", hole), fixtures)]
    else:
        told = [of_command(command.replace("{}", hole), capfd) for command in group.get("commands", ["{}"])]
    for line in told:
        assert "\n" not in line
        for part in parts:
            assert part in line
    assert written() == before
