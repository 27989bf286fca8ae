"""No file that idbench did not write is replaced, results of other commands stay, and killed processes leave nothing behind."""

import json
import os
import subprocess
import sys
import time

import pytest

from idbench.experiments.cli import main
from idbench.experiments.errors import ResultsError
from idbench.experiments.results.folder import ResultsFolder
from idbench.experiments.results.writing import HIDDEN, NAME, Manifest, new_file, write_text
from idbench.identify.files.log_file import read_log, write_log
from idbench.sim.robot.robot import Robot

RUN = "run", "ideal", "--no-rerun", "--out"


def filled(out, text="one", command="idbench run mine", **options):
    """Return a results folder that a command has written."""
    folder = ResultsFolder(out, "run", command, **options)
    with folder.held(), folder.complete() as hidden:
        (hidden / "summary.json").write_text(json.dumps({"experiment": "run"}))
        (hidden / "log.parquet").write_text(text)
    return folder


def added(folder, name, meanwhile=lambda: None):
    """Write one more file to a results folder; something else happens meanwhile."""
    with folder.held(), folder.more() as hidden:
        (hidden / name).write_text("ours")
        meanwhile()


def late(path):
    """Write a file while somebody else writes one of its name."""
    with new_file(path, "--out") as file:
        file.write_text("ours")
        path.write_text("theirs")


def test_the_same_command_replaces_its_own_results_and_no_other_does(tmp_path):
    out = tmp_path / "out"
    filled(out)
    filled(out, "two")
    assert (out / "log.parquet").read_text() == "two"
    with pytest.raises(ResultsError, match="out holds the results of `idbench run mine`: choose another --out"):
        filled(out, "three", "idbench run mine --estimator IV")
    filled(out, "four", "idbench run mine --estimator IV", force=True)
    assert (out / "log.parquet").read_text() == "four"


@pytest.mark.parametrize("name", ["log.parquet", "summary.json", "scenario.toml", "recording.rrd", "log2.parquet"])
def test_a_file_of_the_user_stays(tmp_path, name):
    out = tmp_path / "out"
    out.mkdir()
    (out / name).write_text("precious")
    with pytest.raises(ResultsError, match=f"out holds {name}, not written by idbench or changed since"):
        filled(out)
    assert (out / name).read_text() == "precious"


def test_a_file_that_the_user_has_changed_stays(tmp_path):
    filled(tmp_path / "out")
    (tmp_path / "out" / "log.parquet").write_text("mine now")
    with pytest.raises(ResultsError, match=r"holds run: log.parquet, not written by idbench or changed since"):
        filled(tmp_path / "out", "two")
    assert (tmp_path / "out" / "log.parquet").read_text() == "mine now"


def test_a_file_that_comes_during_the_work_stays(tmp_path):
    """At the moment of the exchange it is looked for once more; what was there before is whole."""
    folder = filled(tmp_path / "out")
    report = tmp_path / "out" / "report.html"
    with pytest.raises(ResultsError, match=r"report.html exists, and idbench did not write it as it is"):
        added(folder, "report.html", lambda: report.write_text("theirs"))
    assert (tmp_path / "out" / "report.html").read_text() == "theirs"
    assert (tmp_path / "out" / "log.parquet").read_text() == "one"


def test_results_replace_all_of_the_earlier_ones_and_further_files_none(tmp_path):
    folder = filled(tmp_path / "out")
    with folder.held():
        with folder.more() as hidden:
            (hidden / "recording.rrd").write_text("page")
            (hidden / "arm.json").write_text("written on demand")
        assert Manifest.of(folder.out).owns("recording.rrd")
    filled(tmp_path / "out", "two")
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == [NAME, "arm.json", "log.parquet", "summary.json"]


def test_force_replaces_what_is_written_and_removes_nothing_of_others(tmp_path, idbench, logs):
    """Logs beside the results stay, above all the one that is read."""
    out = tmp_path / "out"
    out.mkdir()
    (out / "log_of_monday.parquet").write_bytes((logs / "second.parquet").read_bytes())
    (out / "summary.json").write_text("mine")
    words = "--robot", "puma560", "--model", "explicit", "--estimator", "WLS", "--no-rerun", "--out", out, "--force"
    assert idbench("identify", logs / "first.parquet", *words)[0] == 0
    assert read_log(out / "log_of_monday.parquet").samples
    for read in ("log_of_monday.parquet", "log.parquet"):
        code, _, err = idbench("identify", f"out/{read}", *words)
        assert (code, f"out/{read} is a file that this command reads" in err) == (2, True)
    code, _, err = idbench("identify", "out", *words)
    assert (code, "log.parquet is a file that this command reads" in err) == (2, True)
    assert read_log(out / "log_of_monday.parquet").samples


@pytest.mark.thorough
def test_a_command_can_be_repeated(tmp_path, idbench, logs):
    """Its own folder may be called like a scenario, and files that it wrote beside the results are its own."""
    for _ in range(2):
        assert idbench("run", "ideal", "--no-rerun", "--out", "ideal")[0] == 0
    words = "--robot", "puma560", "--model", "explicit", "--estimator", "WLS", "--no-rerun", "--out", "found"
    for _ in range(2):
        assert idbench("identify", logs / "first.parquet", *words, "--write", "found/arm.json")[0] == 0
    code, _, err = idbench("identify", logs / "first.parquet", *words, "--write", "found/summary.json")
    assert (code, "the results have a file of that name" in err) == (2, True)
    (tmp_path / "found" / "arm.json").write_text("mine")
    assert idbench("identify", logs / "first.parquet", *words, "--write", "found/arm.json")[0] == 2
    assert (tmp_path / "found" / "arm.json").read_text() == "mine"


def test_errors_of_others_are_not_called_errors_of_the_folder(tmp_path):
    with pytest.raises(PermissionError, match="Permission denied"), ResultsFolder(tmp_path / "out", "run", "x").held():
        raise PermissionError(13, "Permission denied", "log.csv")


def test_two_runs_into_one_folder_at_once(tmp_path):
    """The second is refused before its work; the first loses nothing."""
    folder = ResultsFolder(tmp_path / "out", "run", "idbench run mine")
    with folder.held():
        with pytest.raises(ResultsError, match="another process is writing its results to"), folder.held():
            pass
        code = f"import sys; from idbench.experiments.cli import main; sys.exit(main({[*RUN, str(tmp_path / 'out')]}))"
        done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
        assert (done.returncode, "another process is writing" in done.stderr) == (2, True)


def test_a_folder_that_was_made_for_nothing_goes(tmp_path):
    with pytest.raises(ZeroDivisionError), ResultsFolder(tmp_path / "a" / "b", "run", "idbench run mine").held():
        _ = 1 / 0
    assert not list(tmp_path.iterdir())


def test_files_that_a_command_reads_are_never_replaced(tmp_path):
    own = tmp_path / "own.xml"
    own.write_text("robot")
    with pytest.raises(ResultsError, match=r"--write .*own.xml is a file that this command reads"):
        write_text(own, "other", "--write", force=True, read=[own])
    out = tmp_path / "out"
    out.mkdir()
    (out / "scenario.toml").write_text("robot")
    folder = ResultsFolder(out, "run", "x", force=True, read=[out / "scenario.toml"])
    with pytest.raises(ResultsError, match=r"scenario.toml is a file that this command reads"):
        added(folder, "scenario.toml")
    assert (own.read_text(), (out / "scenario.toml").read_text()) == ("robot", "robot")


def test_a_new_file_is_whole_and_replaces_none(tmp_path, monkeypatch):
    """Without a look at the mask of the process, which is set to 0 for that and belongs to all threads."""
    monkeypatch.setattr(os, "umask", None)
    write_text(tmp_path / "whole.txt", "text", "--out")
    (tmp_path / "plain.txt").write_text("text")
    assert (tmp_path / "whole.txt").stat().st_mode == (tmp_path / "plain.txt").stat().st_mode
    write_text(tmp_path / "whole.txt", "text", "--out")  # the same contents
    with pytest.raises(ResultsError, match=r"--out .*whole.txt exists: choose another name, or replace it with --force"):
        write_text(tmp_path / "whole.txt", "other", "--out")
    with pytest.raises(ResultsError, match=r"--out .*nowhere.*there is no folder"):
        write_text(tmp_path / "nowhere" / "x.txt", "text", "--out")
    with pytest.raises(ResultsError, match="exists"):
        late(tmp_path / "late.txt")
    assert (tmp_path / "late.txt").read_text() == "theirs"
    assert sorted(path.name for path in tmp_path.iterdir()) == ["late.txt", "plain.txt", "whole.txt"]


def test_commands_ask_before_the_work(tmp_path, complaint, monkeypatch):
    monkeypatch.chdir(tmp_path)
    filled(tmp_path / "kept", command="idbench table2")
    before = {path.name: path.read_bytes() for path in (tmp_path / "kept").iterdir()}
    assert "kept holds the results of `idbench table2`" in complaint("run", "ideal", "--out", "kept")
    assert "kept holds the results of `idbench table2`" in complaint("table1", "--out", "kept")
    assert {path.name: path.read_bytes() for path in (tmp_path / "kept").iterdir()} == before


def test_resample_export_and_log_replace_nothing(tmp_path, complaint, log):
    write_log(log, tmp_path / "log.parquet")
    words = "resample", str(tmp_path / "log.parquet"), "--fs", "50", "--out"
    assert "is a file that this command reads" in complaint(*words, str(tmp_path / "log.parquet"))
    assert main([*words, str(tmp_path / "half.csv")]) == 0
    assert "half.csv exists" in complaint(*words, str(tmp_path / "half.csv"))
    assert main([*words, str(tmp_path / "half.csv"), "--force"]) == 0
    assert read_log(tmp_path / "log.parquet").samples == log.samples
    assert main(["export", str(tmp_path)]) == 0
    assert main(["export", str(tmp_path)]) == 0  # the same once more
    (tmp_path / "log.csv").write_text("mine")
    assert "log.csv exists" in complaint("export", str(tmp_path))
    (tmp_path / "log.png").write_text("mine")
    picture = "log", str(tmp_path / "log.parquet"), "--picture", str(tmp_path / "log.png")
    assert "--picture" in complaint(*picture)
    assert (tmp_path / "log.png").read_text() == "mine"


def test_a_log_with_gaps_replaces_none_of_its_pieces(tmp_path, complaint, log):
    """gp1.csv is the user's: nothing is written at all."""
    write_log(log, tmp_path / "whole.csv")
    lines = (tmp_path / "whole.csv").read_text().splitlines()
    (tmp_path / "gaps.csv").write_text("\n".join([*lines[:1200], *lines[2000:]]))
    (tmp_path / "gp1.csv").write_text("mine")
    words = "resample", str(tmp_path / "gaps.csv"), "--torque", "held", "--out", str(tmp_path / "gp.csv")
    assert "gp1.csv exists" in complaint(*words)
    assert (tmp_path / "gp1.csv").read_text() == "mine"
    assert not (tmp_path / "gp2.csv").exists()


def test_the_robot_of_a_run_that_is_identified_is_not_replaced(tmp_path, complaint):
    """No --robot: the folder of the run states it."""
    own = tmp_path / "arm.xml"
    own.write_text(Robot.path("scara").read_text())
    assert main(["run", "ideal", "--robot", str(own), "--no-rerun", "--out", str(tmp_path / "run")]) == 0
    words = "identify", str(tmp_path / "run"), "--force", "--write", str(own)
    assert "is a file that this command reads" in complaint(*words)
    assert own.read_text() == Robot.path("scara").read_text()


def test_folders_of_killed_processes_go_and_those_of_others_stay(tmp_path):
    dead = next(number for number in range(400_000, 500_000) if not os.path.exists(f"/proc/{number}"))  # noqa: PTH110
    kept = [f"{HIDDEN}{os.getpid()}-abc", ".idbench-notes", f".idbench-elsewhere-{dead}-abc"]
    for name in (f"{HIDDEN}{dead}-abc", *kept):
        (tmp_path / name).mkdir()
    filled(tmp_path)
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted([*kept, NAME, "log.parquet", "summary.json"])


def test_a_process_that_is_killed_lets_its_folder_go(tmp_path, start):
    code = "import time; from pathlib import Path; from idbench.experiments.results.folder import ResultsFolder\n"
    code += "with ResultsFolder(Path('out'), 'run', 'x').held(): print('held', flush=True); time.sleep(60)"
    process = start("-c", code, cwd=tmp_path)
    assert process.stdout.readline() == "held\n"
    process.kill()
    process.wait()
    time.sleep(0.1)
    filled(tmp_path / "out")
