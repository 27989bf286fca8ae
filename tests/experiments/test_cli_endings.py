"""How the command line ends early: interrupted, terminated, out of space; nothing half-written stays."""

import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

import experiments.recording.table1_recording
from experiments.cli import main


def test_interruption_is_quiet_and_leaves_nothing(out, capfd, monkeypatch):
    def interrupted(*args):
        raise KeyboardInterrupt

    monkeypatch.setattr(experiments.recording.table1_recording, "record_table1", interrupted)
    assert main(["table1", "--out", str(out)]) == 130
    assert "interrupted" in capfd.readouterr().err
    assert not list(out.parent.iterdir())


def test_a_real_interrupt_ends_the_process_without_a_traceback(tmp_path, start):
    """Ctrl-C at some instant of a long search."""
    code = "import sys; from experiments.paper.search import Search; from experiments import cli\n"
    code += "from experiments.cli.commands import paper\n"
    code += "paper.Search = lambda seed: print('searching') or Search(seed=seed, tolerance=0.0, rounds=10**6)\n"
    code += "sys.exit(cli.main(['table1', '--seed', '1', '--out', 'results']))"
    process = start("-uc", code, cwd=tmp_path)
    assert process.stdout.readline()  # the search is under way
    time.sleep(0.2)
    process.send_signal(signal.SIGINT)
    _, err = process.communicate()
    assert process.returncode == 130, err
    assert err.strip() == "idbench: interrupted"
    assert not list(tmp_path.iterdir())


def test_an_interrupt_that_comes_out_as_another_error_is_one(tmp_path, start):
    """As of a module that is loaded late, and half loaded."""
    code = """if True:
        import sys, time
        from experiments import cli
        from experiments.cli.commands import paper
        def half_loaded(seed):
            print("searching")
            try:
                time.sleep(30)
            except KeyboardInterrupt:
                raise ImportError("half loaded") from None
        paper.Search = half_loaded
        sys.exit(cli.main(["table1", "--seed", "1", "--out", "results"]))
    """
    process = start("-uc", code, cwd=tmp_path)
    assert process.stdout.readline()
    process.send_signal(signal.SIGINT)
    _, err = process.communicate()
    assert (process.returncode, err.strip()) == (130, "idbench: interrupted")


@pytest.mark.parametrize("module", ["numpy", "scipy.signal", "mujoco", "rerun"])
def test_an_interrupt_while_a_module_is_loaded_is_as_quiet(tmp_path, module, start):
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
    process = start("-c", code, cwd=tmp_path)
    assert process.stdout.readline() == "loading\n"
    process.send_signal(signal.SIGINT)
    _, err = process.communicate()
    assert (process.returncode, err) == (130, "idbench: interrupted\n")
    assert not list(tmp_path.iterdir())


def test_termination_leaves_nothing_half_written(tmp_path, start):
    """SIGTERM while the recording is written: the hidden folder goes, too."""
    code = "import sys; from experiments import cli; import experiments.recording.table1_recording as r\n"
    code += "def slow(*args): print('recording', flush=True); import time; time.sleep(600)\n"
    code += "r.record_table1 = slow\nsys.exit(cli.main(['table1', '--out', 'results']))"
    process = start("-c", code, cwd=tmp_path)
    assert process.stdout.readline()
    assert len(list(tmp_path.iterdir())) == 1
    process.terminate()
    assert process.wait() == 143
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(("size", "kept"), [(20_000, []), (300_000, ["log.parquet", "summary.json"])])
def test_a_full_disk_is_one_line_and_what_has_room_is_kept(tmp_path, size, kept):
    """Too small for the log, and for the recording alone: no file may grow beyond `size` bytes. What was found is printed."""
    code = f"import resource, sys; resource.setrlimit(resource.RLIMIT_FSIZE, ({size}, {size}))\n"
    code += "from experiments.cli import main; sys.exit(main(['table1', '--out', 'results']))"
    done = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert len(done.stderr.splitlines()) == 1
    assert done.stderr.startswith("idbench: cannot write")
    assert "explicit model" in done.stdout
    assert sorted(path.name for path in tmp_path.glob("results/*")) == kept
    assert not list(tmp_path.glob(".idbench-*"))


def test_a_failure_half_way_leaves_earlier_results_whole(out, monkeypatch, capfd, complaint):
    main(["table1", "--out", str(out), "--chain", "paper"])
    before = {path.name: path.read_bytes() for path in out.iterdir()}

    def full(*args):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(experiments.recording.table1_recording, "record_table1", full)
    capfd.readouterr()
    assert "No space left on device" in complaint("table1", "--out", str(out))
    assert {path.name: path.read_bytes() for path in out.iterdir()} == before
    assert list(out.parent.iterdir()) == [out]


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
