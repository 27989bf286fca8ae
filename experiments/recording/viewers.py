"""Viewers that listen: where one is, starting one, serving one to a browser. All on this machine's loopback alone."""

import os
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import closing, contextmanager, suppress
from pathlib import Path
from urllib.parse import quote, urlsplit

from idbench.experiments.errors import ExperimentError

LOOPBACK = "127.0.0.1"

PATIENCE = 20.0  # How long a viewer may take to start, or to take what is on its way to it [s]


def address(url: str) -> tuple[str, int]:
    """Return host and port of a viewer; raise ExperimentError if `url` is no address of one."""
    with suppress(ValueError):
        parts = urlsplit(url)
        if parts.scheme in ("rerun", "rerun+http", "rerun+https") and parts.hostname and parts.port is not None:
            return parts.hostname, parts.port
    raise ExperimentError(f"--connect {url} is no address of a viewer: it looks like rerun+http://127.0.0.1:9876/proxy")


def answers(url: str) -> bool:
    """True if somebody takes connections there."""
    try:
        with closing(socket.create_connection(address(url), 2.0)):
            return True
    except (OSError, UnicodeError):  # a host whose name cannot be one
        return False


def reachable(url: str) -> str:
    """Return the full address of a viewer that runs already; raise ExperimentError if nobody answers."""
    address(url)
    if not answers(url):
        raise ExperimentError(f"no viewer answers at {url}: start one with `uv run rerun --bind {LOOPBACK}`, or use --live")
    return url if urlsplit(url).path.strip("/") else url.rstrip("/") + "/proxy"


def viewer_binary() -> Path:
    """Return the viewer's binary, which lies beside its package."""
    import rerun_cli

    return Path(str(rerun_cli.__file__)).parent / "rerun"


def require_display() -> None:
    """Raise ExperimentError if no window can be opened."""
    if sys.platform == "linux" and not (os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")):
        raise ExperimentError("there is no display here: use --serve and a browser, or --connect URL to a viewer elsewhere")


def start_viewer() -> str:
    """Start a viewer that outlives the command; return where it listens."""
    require_display()
    with closing(socket.socket()) as probe:
        probe.bind((LOOPBACK, 0))
        port = probe.getsockname()[1]
    _start(["--port", f"{port}", "--hide-welcome-screen", "--memory-limit", "50%"], port)
    return f"rerun+http://{LOOPBACK}:{port}/proxy"


def _start(options: list[str], port: int) -> "subprocess.Popen[bytes]":
    quiet, binary = subprocess.DEVNULL, viewer_binary()
    words = [str(binary), "--bind", LOOPBACK, *options]
    try:
        viewer = subprocess.Popen(words, stdin=quiet, stdout=quiet, stderr=quiet, start_new_session=True)
    except OSError as error:
        raise ExperimentError(f"cannot start the rerun viewer {binary}: {error.strerror}") from error
    end = time.perf_counter() + PATIENCE
    try:
        while not answers(f"rerun+http://{LOOPBACK}:{port}/proxy"):
            if viewer.poll() is not None or time.perf_counter() > end:
                raise ExperimentError("the rerun viewer does not start: use --serve and a browser, or leave --live out")
            time.sleep(0.05)
    except BaseException:  # also Ctrl-C: nothing that was begun stays behind
        _stop(viewer)
        raise
    return viewer


def _stop(viewer: "subprocess.Popen[bytes]") -> None:
    viewer.terminate()
    viewer.wait()


@contextmanager
def served(web: int) -> Iterator[str]:
    """Serve the web viewer; give where it listens for data."""
    for port in (web, web + 1):
        _require_free(port)
    server = _start(["--serve-web", "--port", f"{web + 1}", "--web-viewer-port", f"{web}"], web + 1)
    url = f"rerun+http://{LOOPBACK}:{web + 1}/proxy"
    try:
        sys.stderr.write(f"idbench: watch it at http://{LOOPBACK}:{web}/?url={quote(url, safe='')}\n")
        yield url
    finally:
        _stop(server)


def _require_free(port: int) -> None:
    try:
        with closing(socket.socket()) as probe:
            probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            probe.bind((LOOPBACK, port))
    except (OSError, OverflowError) as error:
        raise ExperimentError(
            f"port {port} cannot be used ({error}): give another with --port, which takes two in a row"
        ) from None
