"""Results of one experiment are not replaced by another, and what a killed process leaves behind goes."""

import json
import os

import pytest
from experiments.identification.results import HIDDEN, Place, results_folder, write_whole

from experiments.cli import main
from experiments.errors import ResultsError
from identify.files.log_file import read_log, write_log


def filled(out, **summary):
    out.mkdir(parents=True)
    (out / "summary.json").write_text(json.dumps(summary))
    (out / "log.parquet").write_bytes(b"precious")
    return out


@pytest.mark.parametrize(
    ("summary", "theirs"),
    [
        ({"experiment": "table2"}, "table2"),
        ({"experiment": "run", "scenario": {"name": "other"}}, "run other"),
        ({"experiment": "identify", "log": "a.csv", "path": "/there/a.csv"}, "identify /there/a.csv"),
        ({"what": 1}, "something whose summary.json cannot be read"),
    ],
)
def test_results_of_another_experiment_stay(tmp_path, summary, theirs):
    out = filled(tmp_path / "out", **summary)
    with pytest.raises(ResultsError, match=f"{out} holds {theirs}: choose another --out, or replace them with --force"):
        Place(out, "run", "mine").check()
    with results_folder(Place(out, "run", "mine", force=True)) as folder:
        (folder / "log.parquet").write_bytes(b"new")
    assert (out / "log.parquet").read_bytes() == b"new"


def test_the_same_experiment_replaces_its_own(tmp_path):
    out = filled(tmp_path / "out", experiment="run", scenario={"name": "mine"})
    Place(out, "run", "mine").check()


def test_files_of_nobody_stay(tmp_path):
    (tmp_path / "log.parquet").write_bytes(b"precious")
    with pytest.raises(ResultsError, match=r"holds log.parquet, of no experiment that is known"):
        Place(tmp_path, "identify", "log.parquet").check()


def test_commands_ask_before_the_work(tmp_path, complaint, monkeypatch):
    monkeypatch.chdir(tmp_path)
    filled(tmp_path / "kept", experiment="table2")
    before = {path.name: path.read_bytes() for path in (tmp_path / "kept").iterdir()}
    assert "kept holds table2" in complaint("run", "ideal", "--out", "kept")
    assert "kept holds table2" in complaint("table1", "--out", "kept")
    assert "--out is the folder that you are in, or empty" in complaint("run", "ideal", "--out", "")
    assert {path.name: path.read_bytes() for path in (tmp_path / "kept").iterdir()} == before


def test_resample_and_export_replace_nothing(tmp_path, complaint, log):
    write_log(log, tmp_path / "log.parquet")
    words = "resample", str(tmp_path / "log.parquet"), "--fs", "50", "--out"
    assert "is the log that is read" in complaint(*words, str(tmp_path / "log.parquet"))
    assert main([*words, str(tmp_path / "half.csv")]) == 0
    assert "half.csv exists" in complaint(*words, str(tmp_path / "half.csv"))
    assert main([*words, str(tmp_path / "half.csv"), "--force"]) == 0
    assert read_log(tmp_path / "log.parquet").samples == log.samples
    assert main(["export", str(tmp_path)]) == 0
    assert main(["export", str(tmp_path)]) == 0  # the same once more
    (tmp_path / "log.csv").write_text("mine")
    assert "log.csv exists, with other contents" in complaint("export", str(tmp_path))


def test_folders_of_killed_processes_go_and_those_of_others_stay(tmp_path):
    dead = next(number for number in range(400_000, 500_000) if not os.path.exists(f"/proc/{number}"))  # noqa: PTH110
    kept = [f"{HIDDEN}{os.getpid()}-abc", ".idbench-notes", f".idbench-elsewhere-{dead}-abc"]
    for name in (f"{HIDDEN}{dead}-abc", *kept):
        (tmp_path / name).mkdir()
    with results_folder(Place(tmp_path / "out", "run", "mine")):
        pass
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted([*kept, "out"])


def test_a_file_is_written_whole_with_the_rights_that_new_files_have(tmp_path, monkeypatch):
    """Without a look at the mask of the process, which is set to 0 for that and belongs to all threads."""
    monkeypatch.setattr(os, "umask", None)
    write_whole(tmp_path / "whole.txt", "text")
    (tmp_path / "plain.txt").write_text("text")
    assert (tmp_path / "whole.txt").stat().st_mode == (tmp_path / "plain.txt").stat().st_mode
    with pytest.raises(ResultsError, match=r"cannot write .*nowhere"):
        write_whole(tmp_path / "nowhere" / "x.txt", "text")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["plain.txt", "whole.txt"]
