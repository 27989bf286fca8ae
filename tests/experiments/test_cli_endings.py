"""How the command line ends early: interrupted, terminated, out of space; nothing half-written stays."""

import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

import idbench.experiments.recording.comparison_recording
from idbench.experiments.cli import main
from idbench.experiments.cli.interruption import noticing
from idbench.experiments.results.writing import NAME as MANIFEST

KEPT = ["log.parquet", "summary.json"]
"""What is there before anything is shown."""


def listed(folder):
    return sorted({path.name for path in folder.iterdir()} - {MANIFEST})


FULL = OSError(28, "No space left on device")


def raising(error):
    """Return a function that raises."""

    def function(*args):
        raise error

    return function


@pytest.mark.parametrize(
    ("error", "code", "said"),
    [
        (KeyboardInterrupt(), 130, ("idbench: what was found is printed, and in", "idbench: interrupted")),
        (FULL, 2, ("idbench: the recording: No space left on device; what was found is printed, and in",)),
    ],
    ids=["interrupted", "full"],
)
def test_a_view_that_fails_or_is_interrupted_loses_no_result(out, capfd, monkeypatch, error, code, said):
    monkeypatch.setattr(idbench.experiments.recording.comparison_recording, "record_table1", raising(error))
    assert main(["table1", "--out", str(out)]) == code
    printed = capfd.readouterr()
    lines = printed.err.strip().splitlines()
    assert [line[: len(words)] for line, words in zip(lines, said, strict=True)] == list(said)
    assert "explicit model" in printed.out
    assert listed(out) == KEPT
    assert list(out.parent.iterdir()) == [out]


def test_interruption_of_the_work_leaves_nothing(out, capfd, monkeypatch):
    monkeypatch.setattr("idbench.experiments.cli.commands.paper.print_table1", raising(KeyboardInterrupt()))
    assert main(["table1", "--out", str(out)]) == 130
    assert not list(out.parent.iterdir())


def interrupted(process, line, later=0.0):
    """Interrupt a process some time [s] after it has printed a line; return its errors."""
    assert any(printed == f"{line}\n" for printed in process.stdout)
    time.sleep(later)
    process.send_signal(signal.SIGINT)
    _, err = process.communicate()
    assert process.returncode == 130, err
    return err


def test_a_real_interrupt_ends_the_process_without_a_traceback(tmp_path, start):
    """Ctrl-C at some instant of a long search."""
    code = "import sys; from idbench.experiments.paper.job import TrajectorySearch; from idbench.experiments import cli\n"
    code += "from idbench.experiments.paper import job as paper\n"
    code += (
        "paper.TrajectorySearch = lambda seed: print('searching') or TrajectorySearch(seed=seed, tolerance=0.0, rounds=10**6)\n"
    )
    code += "sys.exit(cli.main(['table1', '--seed', '1', '--out', 'results']))"
    assert interrupted(start("-uc", code, cwd=tmp_path), "searching", 0.2) == "idbench: interrupted\n"
    assert not list(tmp_path.iterdir())


def test_an_interrupt_that_python_ignores_comes_again(capfd):
    """As one that comes while an object goes: what its callback raises is printed, and forgotten."""

    class Lock:
        def __del__(self):
            signal.raise_signal(signal.SIGINT)

    def losing_one():
        with noticing():
            lock = Lock()
            del lock
            time.sleep(30)

    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        with pytest.raises(KeyboardInterrupt):
            losing_one()
    finally:
        signal.signal(signal.SIGINT, before)
    assert capfd.readouterr().err == ""


def test_an_interrupt_that_comes_out_as_another_error_is_one(tmp_path, start):
    """As of a module that is loaded late, and half loaded."""
    code = """if True:
        import sys, time
        from idbench.experiments import cli
        from idbench.experiments.paper import job as paper
        def half_loaded(seed):
            print("searching")
            try:
                time.sleep(30)
            except KeyboardInterrupt:
                raise ImportError("half loaded") from None
        paper.TrajectorySearch = half_loaded
        sys.exit(cli.main(["table1", "--seed", "1", "--out", "results"]))
    """
    assert interrupted(start("-uc", code, cwd=tmp_path), "searching") == "idbench: interrupted\n"


@pytest.mark.thorough
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
        from idbench.experiments.cli import main
        sys.exit(main(["table1", "--out", "x"]))
    """
    kept = "\nidbench: what was found is printed, and in x\n" if module == "rerun" else ""
    assert interrupted(start("-c", code, cwd=tmp_path), "loading") == f"{kept}idbench: interrupted\n"
    assert [listed(path) for path in tmp_path.iterdir()] == ([KEPT] if module == "rerun" else [])


@pytest.mark.thorough
def test_termination_leaves_nothing_half_written(tmp_path, start):
    """SIGTERM while the recording is written: the hidden folder goes, what was complete stays."""
    code = "import sys; from idbench.experiments import cli; import idbench.experiments.recording.comparison_recording as r\n"
    code += "def slow(*args): print('recording', flush=True); import time; time.sleep(600)\n"
    code += "r.record_table1 = slow\nsys.exit(cli.main(['table1', '--out', 'results']))"
    process = start("-uc", code, cwd=tmp_path)
    assert any(line == "recording\n" for line in process.stdout)
    process.terminate()
    assert process.wait() == 143
    assert listed(tmp_path / "results") == KEPT


@pytest.mark.thorough
@pytest.mark.parametrize(("size", "kept"), [(20_000, []), (300_000, ["log.parquet", "summary.json"])])
def test_a_full_disk_is_one_line_and_what_has_room_is_kept(tmp_path, size, kept):
    """Too small for the log, and for the recording alone: no file may grow beyond `size` bytes. What was found is printed."""
    code = f"import resource, sys; resource.setrlimit(resource.RLIMIT_FSIZE, ({size}, {size}))\n"
    code += "from idbench.experiments.cli import main; sys.exit(main(['table1', '--out', 'results']))"
    done = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert len(done.stderr.splitlines()) == 1
    assert done.stderr.startswith("idbench: cannot write")
    assert "explicit model" in done.stdout
    assert (listed(tmp_path / "results") if kept else list(tmp_path.iterdir())) == kept
    assert not list(tmp_path.glob(".idbench-*"))


def test_results_that_cannot_be_written_leave_the_earlier_ones_whole(out, monkeypatch, complaint):
    assert main(["table1", "--no-rerun", "--out", str(out)]) == 0
    before = {path.name: path.read_bytes() for path in out.iterdir()}
    monkeypatch.setattr("idbench.experiments.cli.saving.write_summary", raising(FULL))
    assert "No space left on device" in complaint("table1", "--no-rerun", "--out", str(out))
    assert {path.name: path.read_bytes() for path in out.iterdir()} == before


@pytest.mark.thorough
@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no device that is always full")
@pytest.mark.parametrize(
    ("words", "kept"),
    [
        ("list", ()),
        ("table1", ("runs/table1/summary.json",)),
        (
            "identify LOG --robot puma560 --model explicit --estimator WLS --no-rerun --out found",
            ("found/summary.json", "found/report.html"),
        ),
    ],
)
def test_output_that_cannot_be_written_is_told_and_results_stay(words, kept, logs, tmp_path):
    words = [str(logs / "first.parquet") if word == "LOG" else word for word in words.split()]
    code = f"import sys; from idbench.experiments.cli import main; sys.exit(main({words}))"
    with Path("/dev/full").open("w") as full:
        done = subprocess.run(
            [sys.executable, "-c", code], cwd=tmp_path, stdout=full, stderr=subprocess.PIPE, text=True, check=False
        )
    assert done.returncode == 2
    assert done.stderr.splitlines()[0] == "idbench: cannot print: No space left on device"
    assert all((tmp_path / name).is_file() for name in kept)
