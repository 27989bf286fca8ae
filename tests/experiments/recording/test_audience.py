"""Who watches: what is asked for, what is missing, and who goes away."""

import socket
import subprocess
import sys
import threading
from dataclasses import replace

import pytest

from idbench.experiments.cli import main
from idbench.experiments.errors import ExperimentError
from idbench.experiments.recording.audience import Audience, Watching
from idbench.experiments.results.writing import NAME as MANIFEST
from idbench.sim.scenario.scenario_file import load, to_toml
from idbench.sim.trajectories import RandomMoves

NOBODY = "rerun+http://127.0.0.1:{port}/proxy"


@pytest.fixture
def taken():
    """Give a port that somebody listens at."""
    with socket.socket() as server:
        server.bind(("127.0.0.1", 0))
        server.listen()
        yield server.getsockname()[1]


@pytest.fixture
def free():
    """Return a port that nobody listens at."""
    with socket.socket() as server:
        server.bind(("127.0.0.1", 0))
        return server.getsockname()[1]


def test_a_viewer_that_does_not_answer_is_told_before_anything_is_simulated(complaint, out, free):
    url = NOBODY.format(port=free)
    assert f"no viewer answers at {url}" in complaint("run", "ideal", "--connect", url, "--out", str(out))


@pytest.mark.parametrize("command", [["run", "ideal"], ["table1"], ["table2"], ["study", "delay"]])
def test_a_port_that_is_taken_is_told(complaint, tmp_path, monkeypatch, taken, command):
    monkeypatch.chdir(tmp_path)
    assert f"port {taken} cannot be used" in complaint(*command, "--serve", "--port", str(taken))


@pytest.mark.skipif(sys.platform != "linux", reason="other systems always have a display")
def test_a_missing_display_is_told(complaint, out, monkeypatch):
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    assert "there is no display here: use --serve" in complaint("run", "ideal", "--live", "--out", str(out))


@pytest.mark.thorough
def test_without_rerun_it_is_not_even_loaded(tmp_path):
    code = "import sys; from idbench.experiments.cli import main\n"
    code += "code = main(['run', 'ideal', '--no-rerun', '--out', 'run'])\n"
    code += "code = code or main(['identify', 'run/log.parquet', '--no-rerun'])\n"
    code += "sys.exit(code or [name for name in sys.modules if name.startswith('rerun')] != [])"
    done = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert sorted({x.name for x in (tmp_path / "run").iterdir()} - {MANIFEST}) == [
        "log.parquet",
        "scenario.toml",
        "summary.json",
    ]
    assert "view" not in done.stdout


@pytest.mark.parametrize(("pace", "every"), [(None, 1.0), (1.0, 0.1), (5.0, 0.5), (0.2, 0.1), (100.0, 1.0)])
def test_stretches_are_a_tenth_of_a_second_as_it_passes(pace, every):
    assert Audience("", pace).every == pytest.approx(every)


def brief(folder):
    """Write a scenario of eight seconds; return its file."""
    path = folder / "brief.toml"
    path.write_text(to_toml(replace(load("ideal"), trajectory=RandomMoves(moves=4, rest=1.5))))
    return str(path)


def said_of_viewers(err):
    """Return what was said, but for how far the simulation is, which a slow machine says now and then."""
    return [line for line in err.splitlines() if not line.startswith("simulating")]


@pytest.mark.thorough
def test_a_viewer_that_goes_away_costs_nothing_but_itself(tmp_path, reading):
    """Somebody answers when it is asked whether a viewer is there, and has gone when the run begins."""
    with socket.socket() as server:
        server.bind(("127.0.0.1", 0))
        server.listen()
        url = NOBODY.format(port=server.getsockname()[1])

        def answer_once():
            server.accept()[0].close()
            server.close()

        threading.Thread(target=answer_once, daemon=True).start()
        words = ["run", brief(tmp_path), "--connect", url, "--out", "run"]
        code = "import sys; import idbench.experiments.recording.audience as a; a.GOODBYE = 1.0\n"
        code += f"sys.argv = ['idbench', *{words}]; from idbench.experiments.cli import entry; entry()"
        done = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0
    assert said_of_viewers(done.stderr) == [f"idbench: the viewer at {url} has gone; the work goes on without it"]
    assert "written to run" in done.stdout
    reading.verify(tmp_path / "run" / "recording.rrd")


@pytest.mark.thorough
def test_a_viewer_that_hangs_keeps_nothing_back(tmp_path, reading):
    """It takes connections and never says a word; the run is written, and ends."""
    with socket.socket() as server:
        server.bind(("127.0.0.1", 0))
        server.listen(64)
        url = NOBODY.format(port=server.getsockname()[1])
        words = ["run", brief(tmp_path), "--connect", url, "--out", "run"]
        code = f"import sys; sys.argv = ['idbench', *{words}]; import idbench.experiments.recording.audience as a\n"
        code += "a.GOODBYE = 1.0\n"
        code += "from idbench.experiments.cli import entry; entry()"
        done = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0
    assert said_of_viewers(done.stderr) == [f"idbench: the viewer at {url} takes nothing; the work goes on without it"]
    assert "written to run" in done.stdout
    reading.verify(tmp_path / "run" / "recording.rrd")


@pytest.mark.thorough
def test_a_window_in_which_nothing_lies_is_told(out, capsys):
    assert main(["run", "ideal", "--inner", "1", "2", "--out", str(out)]) == 0
    assert "warning: nothing lies inside the loop from 1 to 2 s" in capsys.readouterr().out


def test_no_viewer_is_nobody():
    with Watching().audience() as audience:
        assert audience is None


def test_errors_name_the_way_out():
    with (
        pytest.raises(ExperimentError, match="uv run rerun --bind"),
        Watching(connect=NOBODY.format(port=1)).audience(),
    ):
        pass
