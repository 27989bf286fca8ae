"""Nonsense is refused and riddles are solved: one line that names the value, what is allowed and the way out."""

import os
import subprocess
import sys

import numpy as np
import pytest

from idbench.experiments.cli import main
from idbench.identify.files.log_file import write_log

DH = 'angles = "rad"\n{gravity}[[joints]]\nname = "a"\n{first}\n[[joints]]\nname = "b"\nalpha = 1.5708\nd = 0.3\n'


@pytest.fixture
def csv(log, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    write_log(log.part(0, 1500), tmp_path / "log.csv")
    return tmp_path / "log.csv"


IDENTIFY = "identify", "log.csv", "--robot", "scara", "--torque", "held", "--torque-delay", "0"


def test_a_plain_robot_is_asked_for_its_speeds_at_once(tmp_path, complaint, monkeypatch):
    """README's own command on a file of which MJCF says no speeds; the options that are named are enough."""
    monkeypatch.chdir(tmp_path)
    limited = '<joint name="{}" axis="0 0 1" range="-2 2"/>'
    (tmp_path / "arm.xml").write_text(
        '<mujoco><compiler angle="radian" autolimits="true"/><worldbody><body name="a">' + limited.format("one")
        + '<geom size="0.05" pos="0.2 0 0"/><body name="b" pos="0.5 0 0">' + limited.format("two")
        + '<geom size="0.05" pos="0.2 0 0"/></body></body></worldbody></mujoco>'
    )  # fmt: skip
    asked = []
    monkeypatch.setattr("idbench.experiments.identification.robot_model.BaseParameters.of", lambda *args: asked.append(args))
    line = complaint("excite", "arm.xml")
    assert "add --velocity with rad/s of all joints or of each, such as --velocity 1.5" in line
    assert "add --acceleration" in complaint("excite", "arm.xml", "--velocity", "1.5")
    assert not asked  # before the parameters are grouped
    monkeypatch.undo()
    monkeypatch.chdir(tmp_path)
    words = "--velocity", "1.5", "--acceleration", "5", "--duration", "4", "--no-rerun", "--out", "out"
    assert main(["excite", "arm.xml", *words]) == 0


def test_files_go_into_the_folder_that_is_made(idbench, logs, tmp_path):
    words = "--robot", "puma560", "--model", "explicit", "--estimator", "WLS", "--no-rerun"
    code, _, err = idbench(
        "identify", logs / "first.parquet", *words, "--out", "found", "--write", "found/a.json", "found/b.py"
    )
    assert (code, err) == (0, "")
    assert {"a.json", "b.py", "summary.json"} <= {path.name for path in (tmp_path / "found").iterdir()}


def test_an_estimator_that_fails_is_not_a_short_log(monkeypatch, complaint, logs):
    from idbench.identify import ESTIMATORS, AbstractEstimator, Estimate

    class Nanny(AbstractEstimator):
        """Gives NaN."""

        def solve(self, problem):
            return Estimate.judge(problem, np.full(len(problem.names), np.nan), np.eye(len(problem.names)))

    monkeypatch.setitem(ESTIMATORS._builtin, "nanny", Nanny)
    line = complaint("identify", str(logs / "first.parquet"), "--robot", "puma560", "--estimator", "nanny")
    assert "gives NaN or infinity" in line
    assert "the estimator fails here, not the log" in line


def test_control_characters_do_not_reach_the_terminal(tmp_path, capfd):
    """A name that would turn the screen red, or what follows around, and begin a line of its own."""
    text = DH.format(gravity="", first="").replace('name = "a"', 'name = "a\\u001b[31mRED\\u009b\\u202e"')
    (tmp_path / "arm.toml").write_text(text)
    main(["robot", str(tmp_path / "arm.toml")])
    main(["robot", str(tmp_path / "no\x1b[31m\nsuch.toml")])
    out, err = capfd.readouterr()
    assert "\x1b" not in out + err
    assert "\x9b" not in out + err
    assert "\u202e" not in out + err
    assert len(err.splitlines()) <= 1 + out.count("\x00")


@pytest.mark.thorough
@pytest.mark.parametrize("encoding", ["cp1252", "latin-1", "ascii"])
def test_other_encodings_of_the_terminal(encoding, start):
    process = start(
        "-c",
        "from idbench.experiments.cli import entry; entry()",
        "robot",
        "scara",
        env=os.environ | {"PYTHONIOENCODING": encoding},
    )
    out, err = process.communicate()
    assert process.returncode == 0, err
    assert "joint1" in out


@pytest.mark.thorough
@pytest.mark.skipif(sys.platform != "linux", reason="names of files are bytes there alone")
def test_names_of_files_that_are_no_utf8(csv):
    name = os.fsencode(csv.parent) + b"/l\xfcg.csv"
    with open(name, "wb") as file:  # noqa: PTH123
        file.write(csv.read_bytes())
    words = [
        b"identify",
        name,
        b"--torque",
        b"held",
        b"--torque-delay",
        b"0",
        b"--model",
        b"explicit",
        b"--no-rerun",
        b"--out",
        b"o",
    ]
    code = "from idbench.experiments.cli import entry; entry()"
    done = subprocess.run([sys.executable, "-c", code, *words], capture_output=True, check=False)
    assert done.returncode == 0, done.stderr
    assert b"l\\xfcg.csv" in done.stdout
    assert b"l\\udcfcg.csv" in (csv.parent / "o" / "report.html").read_bytes()


@pytest.mark.parametrize(
    "words",
    [
        "log {}.csv", "identify {}.csv", "resample {}.csv --out x.csv", "scenario ideal --out {}.toml", "study --resume {}",
        "view {}", "export {}", "new study {}", "run ideal --out {}", "table1 --out {}",
        "identify log.csv --torque held --write {}.json",
    ],
)  # fmt: skip
def test_names_of_300_letters(words, csv, complaint):
    line = complaint(*words.format("a" * 300).split())
    assert "too long" in line or "cannot" in line or "there is no" in line
    assert len(line) < 500


def test_a_pipe_is_not_waited_for(csv, complaint):
    os.mkfifo(csv.parent / "pipe.csv")
    assert "is a pipe: a log is read more than once" in complaint("log", "pipe.csv")


def test_a_small_file_that_unpacks_to_more_than_there_is(tmp_path, complaint, monkeypatch):
    np.savez_compressed(tmp_path / "big.npz", t=np.zeros(200_000), q1=np.zeros(200_000), tau1=np.zeros(200_000))
    monkeypatch.setattr("idbench.identify.files.table.memory", lambda: 1e-3)
    assert "3 arrays of 0.0048 GB: reading them takes 0.0144 GB" in complaint("log", str(tmp_path / "big.npz"))


def test_a_long_log_of_zeros_takes_no_time_for_each_of_its_rows(log):
    """Once the median of all steps was computed for each of them."""
    from idbench.identify.data.clock import LogClock
    from idbench.identify.data.log_columns import LogColumns

    n, calls = 20_000, []
    clock = LogClock.of(LogColumns(np.arange(n) / 1000.0, np.zeros((n, 2)), np.zeros((n, 2)), None))
    original = np.median
    try:
        np.median = lambda *args, **options: calls.append(1) or original(*args, **options)
        assert clock.filled == 0
    finally:
        np.median = original
    assert len(calls) < 10


def test_little_memory_is_told(start):
    code = "import resource; resource.setrlimit(resource.RLIMIT_AS, (10**9, 10**9))\n"
    code += "from idbench.experiments.cli import entry; entry()"
    process = start("-c", code, "list")
    _, err = process.communicate()
    assert process.returncode == 2
    assert "this process may have 1 GB of address space (ulimit -v), idbench needs 1.5 GB" in err


def test_progress_is_told_by_model_and_estimator(csv, monkeypatch, capfd):
    """A line for each stage where there is no terminal, at most every so often; none on standard output."""
    monkeypatch.setattr("idbench.experiments.results.page.EVERY", 0.002)
    assert main([*IDENTIFY, "--estimator", "GLS", "--no-rerun"]) == 0
    out, err = capfd.readouterr()
    assert "identifying: " in err
    assert "model, GLS (" in err
    assert "identifying: " not in out
