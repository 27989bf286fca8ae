"""Files that are wrong on purpose: each line of the table in SECURITY.md."""

import json

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from idbench.experiments.cli import main
from idbench.identify import ESTIMATORS, LogError
from idbench.identify.files.reading import read_columns

DEEP = 100_000


@pytest.fixture
def complaint(capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)

    def said(*words):
        assert main(list(words)) == 2
        return capsys.readouterr().err

    return said


BODY = '<body name="{name}"><joint name="j"/><geom size="1" mass="1"/></body>'
ROBOT = f'<mujoco model="{{name}}">{{before}}<worldbody>{BODY}</worldbody></mujoco>'


def test_entities_of_xml_are_not_expanded(tmp_path, capsys):
    """A billion laughs: a name that would be 10^9 letters long stays what it is in the file."""
    entities = '<!ENTITY a "aaaaaaaaaa">' + "".join(
        f'<!ENTITY {x} "{f"&{y};" * 10}">' for y, x in zip("abcdefgh", "bcdefghi", strict=True)
    )
    text = f'<?xml version="1.0"?><!DOCTYPE lol [{entities}]>' + ROBOT.format(name="&i;", before="")
    (tmp_path / "bomb.xml").write_text(text)
    assert main(["robot", str(tmp_path / "bomb.xml")]) == 0
    assert len(capsys.readouterr().out) < 10_000


def test_xml_that_is_nested_too_deeply_is_refused(tmp_path, complaint):
    (tmp_path / "deep.xml").write_text("<mujoco><worldbody>" + "<body>" * DEEP + "</body>" * DEEP + "</worldbody></mujoco>")
    assert "nesting is too deep" in complaint("robot", "deep.xml")


def test_a_file_that_is_included_from_elsewhere_is_read_as_a_robot_or_not_at_all(tmp_path, complaint):
    """What is no MJCF is refused, and no line of it is printed."""
    (tmp_path / "secret.txt").write_text("password = hunter2\n")
    folder = tmp_path / "robot"
    folder.mkdir()
    (folder / "arm.xml").write_text(ROBOT.format(name="arm", before='<include file="../secret.txt"/>'))
    said = complaint("robot", "robot/arm.xml")
    assert "Include error" in said
    assert "hunter2" not in said


@pytest.mark.parametrize("command", ["run", "study"])
def test_toml_that_is_nested_too_deeply_is_refused(tmp_path, complaint, command):
    (tmp_path / "deep.toml").write_text('name = "deep"\na = ' + "[" * DEEP + "]" * DEEP)
    assert "nested too deeply" in complaint(command, "deep.toml")


def test_json_that_is_nested_too_deeply_is_refused(tmp_path, complaint):
    (tmp_path / "run").mkdir()
    (tmp_path / "run" / "summary.json").write_text("[" * DEEP + "]" * DEEP)
    (tmp_path / "run" / "log.parquet").write_bytes(b"")
    assert "is no summary of a run" in complaint("identify", "run")


def test_a_parquet_file_of_terabytes_in_kilobytes_is_refused_before_it_is_read(tmp_path, monkeypatch):
    """A small file whose columns, unpacked, need more than the memory that there is."""
    rows = 200_000
    table = pa.table({name: np.zeros(rows) for name in ("t", "q1", "tau1")})
    pq.write_table(table, tmp_path / "bomb.parquet", compression="zstd")
    assert (tmp_path / "bomb.parquet").stat().st_size < 10_000
    monkeypatch.setattr("idbench.identify.files.table.memory", lambda: 1e-3)
    with pytest.raises(
        LogError, match=r"holds 2e\+05 samples of 3 columns: reading them takes 0.0144 GB, and there are 0.001 GB"
    ):
        read_columns(tmp_path / "bomb.parquet")


def test_columns_that_a_log_does_not_have_are_not_read(tmp_path, monkeypatch):
    columns = {
        "t": np.arange(50) / 100,
        "q1": np.zeros(50),
        "tau1": np.zeros(50),
        "video": ["x" * 1000] * 50,
        "quality": ["good"] * 50,
    }
    pq.write_table(pa.table(columns), tmp_path / "log.parquet")
    monkeypatch.setattr("idbench.identify.files.table.memory", lambda: 1.1 * 3 * 50 * 8 * 3e-9)
    assert len(read_columns(tmp_path / "log.parquet").t) == 50
    pq.write_table(pa.table(columns | {"q1": ["0.0"] * 50}), tmp_path / "words.parquet")
    with pytest.raises(LogError, match="column q1 holds string, not numbers"):
        read_columns(tmp_path / "words.parquet")


def test_a_plugin_named_like_a_built_in_one_is_not_used(tmp_path, monkeypatch, capsys):
    (tmp_path / "thief.py").write_text("raise SystemExit('run')\n")
    info = tmp_path / "thief-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: thief\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text("[idbench.estimators]\nGLS = thief:GLS\n")
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.delattr(ESTIMATORS, "_found", raising=False)
    ESTIMATORS.__dict__.pop("_found", None)
    try:
        assert ESTIMATORS.create("GLS").__class__.__module__.startswith("idbench.identify.")
        assert any("GLS is built in, thief (thief:GLS) of the same name is not used" in line for line in ESTIMATORS.conflicts)
    finally:
        ESTIMATORS.__dict__.pop("_found", None)


def test_a_scenario_of_0_1_0_is_told_what_to_change(tmp_path, complaint):
    (tmp_path / "old.toml").write_text(
        'name = "old"\nrobot = "scara"\nfs = 100.0\nrest = 3.0\nwaypoints = [[0.0, 0.0], [1.0, 1.0]]\ndurations = [1.0]\n'
    )
    said = complaint("run", "old.toml")
    assert "a scenario of idbench 0.1.0" in said
    assert 'write waypoints, durations, rest below a line [trajectory], with kind = "quintic"' in said
    moved = (
        'name = "new"\n[trajectory]\nkind = "quintic"\nrest = 3.0\nwaypoints = [[0.0, 0.0], [1.0, 1.0]]\ndurations = [1.0]\n'
    )
    (tmp_path / "new.toml").write_text(moved)
    assert main(["scenario", "new.toml"]) == 0


def test_servers_are_reached_from_this_machine_alone(monkeypatch):
    """Every server is started with the loopback address, and no code binds another."""
    from idbench.experiments.recording import audience

    started = []
    monkeypatch.setattr(audience.subprocess, "Popen", lambda words, **_: started.append(words) or _Ended())
    monkeypatch.setattr(audience, "answers", lambda _: True)
    monkeypatch.setattr(audience, "require_display", lambda: None)
    audience.start_viewer()
    (words,) = started
    assert words[words.index("--bind") + 1] == "127.0.0.1"


class _Ended:
    def terminate(self):
        pass

    def wait(self):
        pass


def test_no_file_is_unpickled(root):
    """Nor is text of a file executed."""
    for package in ("identify", "sim", "experiments", "models"):
        for path in (root / package).rglob("*.py"):
            text = path.read_text()
            assert "pickle" not in text.replace("allow_pickle=False", ""), path
            assert "eval(" not in text.replace("literal_eval(", ""), path
            assert "exec(" not in text, path


def test_the_summary_is_json_without_surprises(tmp_path):
    """NaN has no place in it: other readers stop there."""
    from idbench.experiments.results.writing import write_summary

    with pytest.raises(ValueError, match="not JSON compliant"):
        write_summary(tmp_path / "summary.json", {"x": float("nan")})
    write_summary(tmp_path / "summary.json", {"x": 1.0})
    assert json.loads((tmp_path / "summary.json").read_text())["version"]
