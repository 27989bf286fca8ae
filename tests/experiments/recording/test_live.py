"""A viewer without a window receives a run while it goes on."""

import os
import re
import socket
import subprocess
import time
import warnings
from contextlib import suppress
from pathlib import Path

import pytest
import rerun_cli

with warnings.catch_warnings():
    warnings.simplefilter("ignore")  # its interface is declared unstable; our pin holds it
    from rerun.experimental import ViewerClient

DRIVERS = Path("/usr/share/vulkan/icd.d"), Path("/etc/vulkan/icd.d")

pytestmark = pytest.mark.skipif(
    not any(folder.glob("*.json") for folder in DRIVERS if folder.is_dir()),
    reason="the viewer needs a Vulkan driver, as in Debian's mesa-vulkan-drivers",
)

PATIENCE = 600.0
"""Time [s] after which nothing more is expected, also on a busy machine."""

PACE = 4.0
"""46 s of simulated time last longer than it takes to look twice."""


@pytest.fixture
def viewer(tmp_path):
    """Give a viewer without a window: its client, and its process."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    binary = Path(rerun_cli.__file__).parent / "rerun"
    command = [binary, "--headless", "--bind", "127.0.0.1", "--port", f"{port}", "--window-size", "800x600"]
    quiet, environment = subprocess.DEVNULL, os.environ | {"WGPU_BACKEND": "vulkan", "XDG_RUNTIME_DIR": str(tmp_path)}
    process = subprocess.Popen([*command, "--hide-welcome-screen"], stdout=quiet, stderr=quiet, env=environment)
    try:
        yield connected(f"rerun+http://127.0.0.1:{port}/proxy", process), process
    finally:
        process.terminate()
        process.wait(10)


def connected(url, process):
    end = time.monotonic() + PATIENCE
    while time.monotonic() < end and process.poll() is None:
        try:
            client = ViewerClient.connect(url)
            client.get_state()
        except Exception:  # whatever it is that is not ready yet
            time.sleep(0.2)
        else:
            return client
    pytest.fail("the viewer does not start")


def reached(client):
    """Return how much simulated time the viewer has [s]."""
    ends = [t.end for r in client.get_state().recordings for t in r.timelines if t.name == "sim_time" and t.end is not None]
    return max(ends, default=0) / 1e9


def until(condition, process=None):
    end = time.monotonic() + PATIENCE
    while time.monotonic() < end and not condition() and (process is None or process.poll() is None):
        time.sleep(0.2)
    return condition()


def run(start, client, out, *options):
    code = f"import sys; from idbench.experiments.cli import main; sys.exit(main({['run', 'saturation', *options]!r}))"
    return start("-c", code.replace("URL", client.url).replace("OUT", str(out)))


@pytest.mark.thorough
def test_the_arm_moves_in_the_viewer_before_the_run_has_ended(viewer, tmp_path, start):
    client, out = viewer[0], tmp_path / "run"
    process = run(start, client, out, "--connect", "URL", "--out", "OUT", "--pace", f"{PACE}")
    assert until(lambda: reached(client) > 4, process)  # it rests for 3 s
    arm = picture(client)
    assert until(lambda: reached(client) > 12, process)
    assert picture(client) != arm
    assert until(lambda: {"ZZR1 [kg m²]", "residual power [W]"} <= {view.name for view in client.get_state().views}, process)
    assert process.poll() is None  # estimates are there while the robot still moves
    assert process.wait() == 0
    assert until(lambda: reached(client) > 45.9)
    shown = {view.name.split(", rms")[0].split(", largest rms")[0] for view in client.get_state().views}
    assert {"arm", "joint1 [N m]", "residual power [W]", "ZZR1 [kg m²]"} <= shown  # the identification has come, too
    complaints = [e.message for e in client.get_logs() if e.level in ("WARN", "ERROR")]
    assert not [text for text in complaints if not re.search("rasterizer|screenshot|Docker", text)]
    assert not [report.summary for view in client.get_state().views for report in view.reports]


def picture(client):
    """Return how the arm is drawn; views get other names with each new layout, of which one may come in between."""
    for _ in range(10):
        arm = next(view for view in client.get_state().views if view.name == "arm")
        with suppress(ConnectionError):
            return client.take_screenshot(arm.view_id)
    return pytest.fail("the arm is not drawn")


@pytest.mark.thorough
def test_a_viewer_closed_while_the_run_goes_on_is_told_once(viewer, tmp_path, reading, start):
    (client, window), out = viewer, tmp_path / "run"
    process = run(start, client, out, "--connect", "URL", "--out", "OUT", "--pace", f"{PACE}")
    assert until(lambda: reached(client) > 1, process)
    window.terminate()
    printed, err = process.communicate()
    assert process.returncode == 0
    assert len([line for line in err.splitlines() if not line.startswith("simulating")]) == 1
    assert "has gone; the work goes on without it" in err
    assert "written to" in printed
    reading.verify(out / "recording.rrd")
