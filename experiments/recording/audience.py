"""Who watches a run while it goes on: a viewer on this machine, in a browser, or elsewhere."""

import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from idbench.experiments.errors import ExperimentError
from idbench.experiments.program import program
from idbench.experiments.recording.viewers import answers, reachable, served, start_viewer
from idbench.experiments.requests.words import Count, Real, Url

if TYPE_CHECKING:
    import rerun as rr

GOODBYE = 10.0  # How long a viewer may take to take what is still on its way to it, at the end [s]
DEAF = 6  # How often in a row a viewer may fail to take what is sent within half a second
PORT = 9090  # Port of the web viewer


@dataclass(frozen=True)
class Watching:
    """Live viewing and recording."""

    live: bool = False
    """Show everything live in a rerun viewer."""
    connect: Url = None
    """Show everything live in a running viewer, such as rerun+http://127.0.0.1:9876/proxy."""
    serve: bool = False
    """Show everything live in a browser: serve the web viewer on this machine until Ctrl-C."""
    port: Count = None
    """Port of the web viewer. Default: 9090; data use the next port."""
    pace: Real = None
    """Simulated seconds per second of live view, such as 1.0. Default: as fast as possible."""
    rerun: bool = True
    """Write a recording."""

    def __post_init__(self) -> None:
        ways = [name for name, given in (("--live", self.live), ("--connect", self.connect), ("--serve", self.serve)) if given]
        if len(ways) > 1:
            raise ExperimentError(f"{' and '.join(ways)} name several viewers: give one")
        if self.pace is not None and not (0 < self.pace < float("inf")):
            raise ExperimentError(f"--pace {self.pace:g} must be above 0: 1.0 is real time")
        if self.pace is not None and not ways:
            raise ExperimentError(f"--pace {self.pace:g} needs somebody who watches: add --live, --serve or --connect URL")
        if self.port is not None and not self.serve:
            raise ExperimentError(f"--port {self.port} is that of the web viewer: add --serve, or leave it out")
        if self.port is not None and not 0 < self.port < 65535:
            raise ExperimentError(f"--port {self.port} must be between 1 and 65534; data go through the port after it")
        if ways and not self.rerun:
            raise ExperimentError(f"{ways[0]} and --no-rerun contradict each other: give one")

    def hint(self, out: Path) -> str:
        """Hint how to view results in `out`."""
        return f"; see it: {program()} view {out}" if self.rerun else ""

    @contextmanager
    def audience(self) -> Iterator["Audience | None"]:
        """Give who watches, if anybody does; a web viewer is served until Ctrl-C once the block is done.

        Raises
        ------
        ExperimentError
            If no viewer can be started or reached.
        """
        if self.connect:
            yield Audience(reachable(self.connect), self.pace)
        elif self.live:
            yield Audience(start_viewer(), self.pace)
        elif self.serve:
            with served(PORT if self.port is None else self.port) as url:
                yield Audience(url, self.pace)
                sys.stderr.write("idbench: done; served until Ctrl-C\n")
                with suppress(KeyboardInterrupt):
                    while True:
                        time.sleep(3600)
                sys.stderr.write("\n")
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
