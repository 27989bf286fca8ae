"""Who watches a run while it goes on: a viewer on this machine, in a browser, or elsewhere."""

import os
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import closing, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated
from urllib.parse import quote, urlsplit

import tyro

from experiments.errors import ExperimentError

if TYPE_CHECKING:
    import rerun as rr

LOOPBACK = "127.0.0.1"

PATIENCE = 20.0
"""How long a viewer may take to start [s]."""

Url = Annotated[str | None, tyro.conf.arg(metavar="URL")]
Times = Annotated[float | None, tyro.conf.arg(metavar="FLOAT")]
Window = Annotated[tuple[float, float] | None, tyro.conf.arg(metavar="FROM TO")]


@dataclass(frozen=True)
class Watching:
    """How the command is watched."""

    live: bool = False
    """Open a rerun viewer and show everything while it is computed."""
    connect: Url = None
    """Show it in a viewer that runs already, such as rerun+http://127.0.0.1:9876/proxy."""
    serve: bool = False
    """Show it in a browser: serve the web viewer on this machine until Ctrl-C."""
    port: int = 9090
    """Port of the web viewer; data go through the port after it."""
    pace: Times = None
    """Simulated seconds shown in a second, such as 1.0; as fast as possible without it."""
    rerun: bool = True
    """Record; without it rerun is not even loaded."""

    def __post_init__(self) -> None:
        ways = [name for name, given in (("--live", self.live), ("--connect", self.connect), ("--serve", self.serve)) if given]
        if len(ways) > 1:
            raise ExperimentError(f"{' and '.join(ways)} name several viewers: give one")
        if self.pace is not None and not (0 < self.pace < float("inf")):
            raise ExperimentError(f"--pace {self.pace:g} must be above 0: 1.0 is real time")
        if self.pace is not None and not ways:
            raise ExperimentError(f"--pace {self.pace:g} needs somebody who watches: add --live, --serve or --connect URL")
        if ways and not self.rerun:
            raise ExperimentError(f"{ways[0]} and --no-rerun contradict each other: give one")

    def hint(self, out: Path) -> str:
        """Return how to see what was written to `out`."""
        return f"; see it: uv run idbench view {out}" if self.rerun else ""

    @contextmanager
    def audience(self) -> "Iterator[Audience | None]":
        """Give who watches, if anybody does; a web viewer is served until Ctrl-C once the block is done.

        Raises
        ------
        ExperimentError
            If no viewer can be started or reached.
        """
        if self.connect:
            yield Audience(_reachable(self.connect), self.pace)
        elif self.live:
            yield Audience(_spawned(), self.pace)
        elif self.serve:
            with served(self.port) as url:
                yield Audience(url, self.pace)
                _until_interrupted()
        else:
            yield None


Watched = Annotated[Watching, tyro.conf.OmitArgPrefixes, tyro.conf.OmitSubcommandPrefixes]
"""The same options for every command."""


class Audience:
    """A viewer that watches; when it goes, that is said once, and the work goes on.

    Parameters
    ----------
    url : str
        Where it listens.
    pace : float, optional
        Simulated seconds in a second.
    """

    def __init__(self, url: str, pace: float | None = None) -> None:
        self.url, self.pace, self.watching, self._start = url, pace, True, time.perf_counter()

    @property
    def every(self) -> float:
        """How much simulated time is shown at once [s]: a tenth of a second as it passes, 0.1 to 1 s."""
        return 1.0 if self.pace is None else min(1.0, max(0.1, 0.1 * self.pace))

    def begin(self) -> None:
        """Start the clock by which the pace is kept."""
        self._start = time.perf_counter()

    def reached(self, recording: "rr.RecordingStream", seconds: float | None) -> bool:
        """Hand on what was sent; wait until `seconds` of simulated time are due; return whether the viewer still watches."""
        try:
            recording.flush(timeout_sec=0.5 if seconds is not None else PATIENCE)
        except RuntimeError:  # rerun tells a slow viewer and one that has gone apart in words alone
            self.watching = _answers(self.url)
            if not self.watching:
                sys.stderr.write(f"idbench: the viewer at {self.url} has gone; the work goes on without it\n")
        if self.watching and self.pace and seconds is not None:
            time.sleep(max(0.0, self._start + seconds / self.pace - time.perf_counter()))
        return self.watching


def _address(url: str) -> tuple[str, int]:
    parts = urlsplit(url)
    try:
        host, port = parts.hostname, parts.port
    except ValueError:
        host, port = None, None
    if parts.scheme not in ("rerun", "rerun+http", "rerun+https") or not host or port is None:
        raise ExperimentError(f"--connect {url} is no address of a viewer: it looks like rerun+http://127.0.0.1:9876/proxy")
    return host, port


def _answers(url: str) -> bool:
    try:
        with closing(socket.create_connection(_address(url), 2.0)):
            return True
    except OSError:
        return False


def _reachable(url: str) -> str:
    _address(url)
    if not _answers(url):
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


def _spawned() -> str:
    """Start a viewer that outlives the command; return where it listens."""
    require_display()
    with closing(socket.socket()) as probe:
        probe.bind((LOOPBACK, 0))
        port = probe.getsockname()[1]
    _start(["--port", f"{port}", "--hide-welcome-screen", "--memory-limit", "50%"], port)
    return f"rerun+http://{LOOPBACK}:{port}/proxy"


def _start(options: list[str], port: int) -> "subprocess.Popen[bytes]":
    quiet, binary = subprocess.DEVNULL, viewer_binary()
    try:
        viewer = subprocess.Popen(
            [binary, "--bind", LOOPBACK, *options], stdin=quiet, stdout=quiet, stderr=quiet, start_new_session=True
        )
    except OSError as error:
        raise ExperimentError(f"cannot start the rerun viewer {binary}: {error.strerror}") from error
    end = time.perf_counter() + PATIENCE
    while not _answers(f"rerun+http://{LOOPBACK}:{port}/proxy"):
        if viewer.poll() is not None or time.perf_counter() > end:
            viewer.terminate()
            raise ExperimentError("the rerun viewer does not start: use --serve and a browser, or leave --live out")
        time.sleep(0.05)
    return viewer


@contextmanager
def served(web: int) -> Iterator[str]:
    """Serve the web viewer; give where it listens for data."""
    for port in (web, web + 1):
        _require_free(port)
    server = _start(["--serve-web", "--port", f"{web + 1}", "--web-viewer-port", f"{web}"], web + 1)
    url = f"rerun+http://{LOOPBACK}:{web + 1}/proxy"
    sys.stderr.write(f"idbench: watch it at http://{LOOPBACK}:{web}/?url={quote(url, safe='')}\n")
    try:
        yield url
    finally:
        server.terminate()
        server.wait()


def _require_free(port: int) -> None:
    try:
        with closing(socket.socket()) as probe:
            probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            probe.bind((LOOPBACK, port))
    except (OSError, OverflowError) as error:
        raise ExperimentError(
            f"port {port} cannot be used ({error}): give another with --port, which takes two in a row"
        ) from None


def _until_interrupted() -> None:
    sys.stderr.write("idbench: done; served until Ctrl-C\n")
    try:
        while True:
            time.sleep(3600)
    except KeyboardInterrupt:
        sys.stderr.write("\n")
