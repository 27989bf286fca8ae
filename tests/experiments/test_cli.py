"""The command line as a user meets it: answers, files, wrong input, interruption."""

import json
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
import tomli_w

import experiments.recording.table1
from experiments.cli import main
from experiments.table1 import SCENARIO
from identify.log_file import read_log
from sim.scenario import Scenario


@pytest.fixture
def out(tmp_path):
    return tmp_path / "results"


def complaint(capfd, *args):
    """Run the command line on wrong input; return its one line of complaint."""
    assert main(list(args)) == 2
    lines = capfd.readouterr().err.strip().splitlines()
    assert len(lines) == 1
    assert lines[0].startswith("idbench: ")
    return lines[0]


def test_table1_prints_and_writes_everything(out, capsys):
    assert main(["table1", "--out", str(out)]) == 0
    printed = capsys.readouterr().out
    for text in (
        "explicit model",
        "implicit model",
        "power model",
        "energy form",
        "0.649",
        "3.502",
        "Cond(W)",
        "rows",
        "all three",
    ):
        assert text in printed
    assert sorted(path.name for path in out.iterdir()) == ["log.parquet", "recording.rrd", "summary.json"]
    summary = json.loads((out / "summary.json").read_text())
    assert (summary["experiment"], summary["seed"], summary["chain"]) == ("table1", 0, "idbench")
    assert summary["models"]["explicit"]["rows"] == 800
    assert Scenario.from_dict(summary["scenario"]) == Scenario.load(SCENARIO)
    assert read_log(out / "log.parquet").samples == 4600
    assert list(out.parent.iterdir()) == [out]


def test_table1_repeats_itself(tmp_path, capsys):
    for name in ("a", "b"):
        main(["table1", "--out", str(tmp_path / name), "--seed", "5"])
    a, b = (json.loads((tmp_path / name / "summary.json").read_text()) for name in ("a", "b"))
    assert a == b
    assert a["seed"] == 5
    assert a["scenario"]["waypoints"] != list(map(list, Scenario.load(SCENARIO).waypoints))


def test_one_chain_may_be_asked_for(out, capsys):
    assert main(["table1", "--out", str(out), "--chain", "paper"]) == 0
    assert "idbench X" not in capsys.readouterr().out
    summary = json.loads((out / "summary.json").read_text())
    assert summary["chain"] == "paper"
    assert summary["models"]["explicit"]["relative_error_percent"][0] > 0.01
    assert "idbench_chain" not in summary


def test_an_unknown_chain_lists_the_known_and_leaves_nothing(out, capfd):
    line = complaint(capfd, "table1", "--out", str(out), "--chain", "papre")
    assert "no 'papre' among the chains (did you mean 'paper'?); known: paper, idbench" in line
    assert not out.exists()
    assert not list(out.parent.iterdir())


def test_an_output_folder_that_cannot_be_written_is_told(tmp_path, capfd):
    (tmp_path / "file").write_text("precious")
    assert "is a file, not a folder" in complaint(capfd, "table1", "--out", str(tmp_path / "file"))
    assert "cannot write to" in complaint(capfd, "table1", "--out", str(tmp_path / "file" / "below"))
    assert (tmp_path / "file").read_text() == "precious"


def test_a_failure_half_way_leaves_earlier_results_whole(out, monkeypatch, capfd):
    main(["table1", "--out", str(out), "--chain", "paper"])
    before = {path.name: path.read_bytes() for path in out.iterdir()}

    def full(*args):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(experiments.recording.table1, "record_table1", full)
    capfd.readouterr()
    assert "No space left on device" in complaint(capfd, "table1", "--out", str(out))
    assert {path.name: path.read_bytes() for path in out.iterdir()} == before
    assert list(out.parent.iterdir()) == [out]


def test_interruption_is_quiet_and_leaves_nothing(out, capfd, monkeypatch):
    def interrupted(*args):
        raise KeyboardInterrupt

    monkeypatch.setattr(experiments.recording.table1, "record_table1", interrupted)
    assert main(["table1", "--out", str(out)]) == 130
    assert "interrupted" in capfd.readouterr().err
    assert not list(out.parent.iterdir())


def test_a_real_interrupt_ends_the_process_without_a_traceback(tmp_path):
    """Ctrl-C at some instant of a long search."""
    code = "import sys; from experiments.search import Search; from experiments import commands\n"
    code += "commands.Search = lambda seed: print('searching') or Search(seed=seed, tolerance=0.0, rounds=10**6)\n"
    code += "sys.exit(commands.run(['table1', '--seed', '1', '--out', 'results']))"
    process = subprocess.Popen(
        [sys.executable, "-uc", code], cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    assert process.stdout.readline()  # the search is under way
    time.sleep(0.2)
    process.send_signal(signal.SIGINT)
    _, err = process.communicate(timeout=30)
    assert process.returncode == 130
    assert err.strip() == "idbench: interrupted"
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("module", ["numpy", "scipy.signal", "mujoco", "rerun"])
def test_an_interrupt_while_a_module_is_loaded_is_as_quiet(tmp_path, module):
    code = f"""if True:
        import sys, time
        class Slow:
            def find_spec(self, name, path=None, target=None):
                if name == {module!r}:
                    print("loading", flush=True)
                    time.sleep(30)
        sys.meta_path.insert(0, Slow())
        from experiments.cli import main
        sys.exit(main(["table1", "--out", "x"]))
    """
    with subprocess.Popen(
        [sys.executable, "-c", code], cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as process:
        assert process.stdout.readline() == "loading\n"
        process.send_signal(signal.SIGINT)
        _, err = process.communicate(timeout=20)
    assert (process.returncode, err) == (130, "idbench: interrupted\n")
    assert not list(tmp_path.iterdir())


def test_termination_leaves_nothing_half_written(tmp_path):
    """SIGTERM while the recording is written: the hidden folder goes, too."""
    code = "import sys; from experiments import commands; import experiments.recording.table1 as r\n"
    code += "def slow(*args): print('recording', flush=True); import time; time.sleep(60)\n"
    code += "r.record_table1 = slow\nsys.exit(commands.run(['table1', '--out', 'results']))"
    with subprocess.Popen([sys.executable, "-c", code], cwd=tmp_path, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout.readline()
        assert len(list(tmp_path.iterdir())) == 1
        process.terminate()
        assert process.wait(timeout=30) == 143
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("size", [20_000, 300_000])
def test_a_full_disk_is_one_line(tmp_path, size):
    """Too small for the log, and for the recording alone: no file may grow beyond `size` bytes."""
    code = f"import resource, sys; resource.setrlimit(resource.RLIMIT_FSIZE, ({size}, {size}))\n"
    code += "from experiments.cli import main; sys.exit(main(['table1', '--out', 'results']))"
    done = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert len(done.stderr.splitlines()) == 1
    assert done.stderr.startswith("idbench: cannot write")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("args", "message"),
    [
        (["table1", "--seed", "-1"], "seed = -1 must be 0 or a positive whole number"),
        (["search", "--seed", "-1"], "seed = -1 must be 0 or a positive whole number"),
        (["table1", "--out", "a" * 300], "File name too long"),
        (["table1", "--seed", "1", "--scenario", "x.toml"], "name two trajectories: give one"),
        (["table1", "--scenario", "nowhere.toml"], "cannot read scenario nowhere.toml"),
        (["view", "README.md"], "there is no recording README.md"),
    ],
)
def test_more_wrong_input_is_one_line(args, message, capfd, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert message in complaint(capfd, *args)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"waypoints": [[0.0], [1.0], [0.0]], "durations": [1.0, 1.0]}, "the trajectory moves 1 joints, robot 'scara' has 2"),
        (
            {"waypoints": [[0.0, 0.0], [4.0, 1.0]], "durations": [1.0]},
            "joint1 would move from 0 to 4 rad, its range is -2.4 to 2.4",
        ),
        ({"durations": [1.0]}, "31 waypoints need 30 durations, not 1"),
        ({"fs": 1e9}, "fs = 1e+09 Hz makes more than 1e+08 samples"),
        ({"rest": 1.0}, "rest = 1 s is shorter than the 2.81 s that chain paper looks: raise it"),
        ({"robot": "scora"}, "no robot 'scora'; known: scara"),
    ],
)
def test_scenarios_that_make_no_sense_are_one_line(changes, message, tmp_path, capfd):
    path = tmp_path / "scenario.toml"
    path.write_text(tomli_w.dumps({**Scenario.load(SCENARIO).to_dict(), **changes}))
    assert message in complaint(capfd, "table1", "--scenario", str(path), "--out", str(tmp_path / "out"))
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize("command", ["list", "table1"])
def test_output_that_cannot_be_written_is_told_and_results_stay(command, tmp_path):
    if not Path("/dev/full").exists():
        pytest.skip("no device that is always full")
    code = f"import sys; from experiments.cli import main; sys.exit(main([{command!r}]))"
    with Path("/dev/full").open("w") as full:
        done = subprocess.run(
            [sys.executable, "-c", code], cwd=tmp_path, stdout=full, stderr=subprocess.PIPE, text=True, check=False
        )
    assert done.returncode == 2
    assert done.stderr.splitlines()[0] == "idbench: cannot print: No space left on device"
    assert (tmp_path / "runs" / "table1" / "summary.json").exists() == (command == "table1")


def test_a_folder_in_the_place_of_a_file_stops_all(out, capfd):
    (out / "recording.rrd").mkdir(parents=True)
    assert "recording.rrd is a folder where a file must go" in complaint(capfd, "table1", "--out", str(out))
    assert [path.name for path in out.iterdir()] == ["recording.rrd"]


def test_results_go_through_a_link(tmp_path, capsys):
    (tmp_path / "elsewhere").mkdir()
    (tmp_path / "link").symlink_to(tmp_path / "elsewhere")
    assert main(["table1", "--chain", "idbench", "--out", str(tmp_path / "link")]) == 0
    assert len(list((tmp_path / "elsewhere").iterdir())) == 3


def test_view_tells_where_there_is_no_display(out, capfd, monkeypatch):
    out.mkdir()
    (out / "recording.rrd").write_bytes(b"RRF2")
    monkeypatch.setattr(sys, "platform", "linux")
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    assert "there is no display here" in complaint(capfd, "view", str(out))


def test_version(capsys):
    assert main(["--version"]) == 0
    assert capsys.readouterr().out.startswith("idbench 0.")


def test_search_writes_a_scenario(tmp_path, capsys):
    path = tmp_path / "found.toml"
    assert main(["search", "--seed", "5", "--out", str(path)]) == 0
    found = Scenario.load(path)
    assert found.seed == 5
    assert main(["table1", "--scenario", str(path), "--chain", "idbench", "--out", str(tmp_path / "out")]) == 0
    assert Scenario.from_dict(json.loads((tmp_path / "out" / "summary.json").read_text())["scenario"]) == found
    assert main(["search", "--seed", "5"]) == 0
    assert path.read_text() in capsys.readouterr().out


def test_search_says_where_it_cannot_write(tmp_path, capfd):
    assert "cannot write" in complaint(capfd, "search", "--seed", "5", "--out", str(tmp_path / "nowhere" / "found.toml"))


def test_list_shows_every_plugin_with_a_line(capsys):
    assert main(["list"]) == 0
    printed = capsys.readouterr().out
    for name in (
        "scara",
        "coulomb",
        "explicit",
        "butterworth",
        "central",
        "reversal",
        "windows",
        "modulating",
        "idbench",
        "OLS",
    ):
        assert name in printed


def test_view_needs_a_recording(tmp_path, capfd):
    assert "there is no recording" in complaint(capfd, "view", str(tmp_path))


def test_wrong_words_exit_with_2(capfd):
    with pytest.raises(SystemExit) as ended:
        main(["tabel1"])
    assert ended.value.code == 2


def test_a_reader_that_goes_away_is_no_error(tmp_path):
    code = "import sys; from experiments.cli import main; sys.exit(main(['list']))"
    with subprocess.Popen(
        [sys.executable, "-c", code], cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as process:
        process.stdout.close()
        assert process.stderr.read() == ""
    assert process.returncode == 0
