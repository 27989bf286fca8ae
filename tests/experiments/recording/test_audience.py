"""Who watches: what is asked for, what is missing, and who goes away."""

import socket
import subprocess
import sys
import threading
from dataclasses import replace

import pytest

from idbench.experiments.cli import main
from idbench.experiments.recording.audience import Audience, Watching
from idbench.sim.scenario.scenario_file import load, to_toml
from idbench.sim.trajectories import RandomMoves

NOBODY = "rerun+http://127.0.0.1:{port}/proxy"


@pytest.fixture
def free():
    """Return a port that nobody listens at."""
    with socket.socket() as server:
        server.bind(("127.0.0.1", 0))
        return server.getsockname()[1]


@pytest.mark.parametrize("url", [NOBODY, "rerun+http://a..b:{port}/proxy"])
def test_a_viewer_that_does_not_answer_is_told_before_anything_is_simulated(complaint, out, free, url):
    printed = complaint("run", "ideal", "--connect", url.format(port=free), "--out", str(out))
    assert f"no viewer answers at {url.format(port=free)}" in printed
    assert "uv run rerun --bind" in printed  # the way out


@pytest.mark.skipif(sys.platform != "linux", reason="other systems always have a display")
def test_a_missing_display_is_told(complaint, out, monkeypatch):
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    assert "there is no display here: `uv run rerun --serve-web" in complaint("run", "ideal", "--live", "--out", str(out))


@pytest.mark.parametrize(("pace", "every"), [(None, 1.0), (1.0, 0.1), (5.0, 0.5), (0.2, 0.1), (100.0, 1.0)])
def test_stretches_are_a_tenth_of_a_second_as_it_passes(pace, every):
    assert Audience("", pace).every == pytest.approx(every)


def said_of_viewers(err):
    """Return what was said, but for how far the simulation is, which a slow machine says now and then."""
    return [line for line in err.splitlines() if not line.startswith("simulating")]


@pytest.mark.thorough
@pytest.mark.parametrize("said", ["has gone", "takes nothing"])
def test_a_viewer_that_goes_away_or_hangs_costs_nothing_but_itself(tmp_path, reading, said):
    """One answers when it is asked whether a viewer is there, and has gone when the run begins; one never says a word."""
    eight_seconds = replace(load("ideal"), trajectory=RandomMoves(moves=4, rest=1.5))
    (tmp_path / "brief.toml").write_text(to_toml(eight_seconds))
    with socket.socket() as server:
        server.bind(("127.0.0.1", 0))
        server.listen(64)
        url = NOBODY.format(port=server.getsockname()[1])

        def answer_once():
            server.accept()[0].close()
            server.close()

        if said == "has gone":
            threading.Thread(target=answer_once, daemon=True).start()
        words = ["run", "brief.toml", "--connect", url, "--out", "run"]
        code = "import sys; import idbench.experiments.recording.audience as a; a.GOODBYE = 1.0\n"
        code += f"sys.argv = ['idbench', *{words}]; from idbench.experiments.cli import entry; entry()"
        done = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0
    assert said_of_viewers(done.stderr) == [f"idbench: the viewer at {url} {said}; the work goes on without it"]
    assert "written to run" in done.stdout
    reading.verify(tmp_path / "run" / "recording.rrd")


@pytest.mark.thorough
def test_a_window_in_which_nothing_lies_is_told(out, capsys):
    assert main(["run", "ideal", "--inner", "1", "2", "--out", str(out)]) == 0
    assert "warning: nothing lies inside the loop from 1 to 2 s" in capsys.readouterr().out


def test_no_viewer_is_nobody():
    with Watching().audience() as audience:
        assert audience is None
