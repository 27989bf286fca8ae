"""Who watches a run while it goes on: a viewer on this machine, in a browser, or elsewhere."""

import os
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import closing, contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING
from urllib.parse import urlsplit

from idbench.experiments.errors import ExperimentError
from idbench.experiments.program import program
from idbench.experiments.requests.words import Real, Url

LOOPBACK = "127.0.0.1"

IN_BROWSER = f"`uv run rerun --serve-web --bind {LOOPBACK}` shows it in a browser: add --connect with the URL that it prints"

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
        raise ExperimentError("there is no display here: " + IN_BROWSER)


def start_viewer() -> str:
    """Start a viewer that outlives the command; return where it listens."""
    require_display()
    with closing(socket.socket()) as probe:
        probe.bind((LOOPBACK, 0))
        port = probe.getsockname()[1]
    _start(["--port", f"{port}", "--hide-welcome-screen", "--memory-limit", "50%"], port)
    return f"rerun+http://{LOOPBACK}:{port}/proxy"


def _start(options: list[str], port: int) -> None:
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
                raise ExperimentError("the rerun viewer does not start: leave --live out; " + IN_BROWSER)
            time.sleep(0.05)
    except BaseException:  # also Ctrl-C: nothing that was begun stays behind
        viewer.terminate()
        viewer.wait()
        raise


if TYPE_CHECKING:
    import rerun as rr

GOODBYE = 10.0  # How long a viewer may take to take what is still on its way to it, at the end [s]
DEAF = 6  # How often in a row a viewer may fail to take what is sent within half a second


@dataclass(frozen=True)
class Watching:
    """Live viewing and recording."""

    live: bool = False
    """Show everything live in a rerun viewer."""
    connect: Url = None
    """Show everything live in a running viewer, such as rerun+http://127.0.0.1:9876/proxy."""
    pace: Real = None
    """Simulated seconds per second of live view, such as 1.0. Default: as fast as possible."""
    rerun: bool = True
    """Write a recording."""

    def __post_init__(self) -> None:
        ways = [name for name, given in (("--live", self.live), ("--connect", self.connect)) if given]
        if len(ways) > 1:
            raise ExperimentError(f"{' and '.join(ways)} name several viewers: give one")
        if self.pace is not None and not (0 < self.pace < float("inf")):
            raise ExperimentError(f"--pace {self.pace:g} must be above 0: 1.0 is real time")
        if self.pace is not None and not ways:
            raise ExperimentError(f"--pace {self.pace:g} needs somebody who watches: add --live or --connect URL")
        if ways and not self.rerun:
            raise ExperimentError(f"{ways[0]} and --no-rerun contradict each other: give one")

    def hint(self, out: Path) -> str:
        """Hint how to view results in `out`."""
        return f"; see it: {program()} view {out}" if self.rerun else ""

    @contextmanager
    def audience(self) -> Iterator["Audience | None"]:
        """Give who watches, if anybody does.

        Raises
        ------
        ExperimentError
            If no viewer can be started or reached.
        """
        if self.connect:
            yield Audience(reachable(self.connect), self.pace)
        elif self.live:
            yield Audience(start_viewer(), self.pace)
        else:
            yield None


class Audience:
    """A viewer that watches at `pace` simulated seconds in a second; when it goes, one line says so, and the work goes on."""

    def __init__(self, url: str, pace: float | None = None) -> None:
        self.url = url
        self.pace = pace
        self.watching = True
        self._start = time.perf_counter()
        self._deaf = 0

    @property
    def every(self) -> float:
        """How much simulated time is shown at once [s]: a tenth of a second as it passes, 0.1 to 1 s."""
        return 1.0 if self.pace is None else min(1.0, max(0.1, 0.1 * self.pace))

    def begin(self) -> None:
        """Start the clock by which the pace is kept."""
        self._start = time.perf_counter()

    def reached(self, recording: "rr.RecordingStream", seconds: float | None) -> bool:
        """Hand on what was sent; wait until `seconds` of simulated time are due; return whether the viewer still watches."""
        if not self.watching:
            return False
        try:
            recording.flush(timeout_sec=0.5 if seconds is not None else GOODBYE)
            self._deaf = 0
        except RuntimeError:  # rerun tells a slow viewer and one that has gone apart in words alone
            self._deaf += 1
            gone = not answers(self.url)
            self.watching = not gone and self._deaf < DEAF and seconds is not None
            if not self.watching:
                why = "has gone" if gone else "takes nothing"
                sys.stderr.write(f"idbench: the viewer at {self.url} {why}; the work goes on without it\n")
        if self.watching and self.pace and seconds is not None:
            time.sleep(max(0.0, self._start + seconds / self.pace - time.perf_counter()))
        return self.watching

    def leave(self, recording: "rr.RecordingStream") -> None:
        """Take leave of the viewer; one that hangs is left behind, with the thread that waits for it."""
        thread = threading.Thread(target=recording.disconnect, name="idbench-leaving", daemon=True)
        thread.start()
        thread.join(GOODBYE)
