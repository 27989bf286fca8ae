"""How far a long work is: on a terminal in place, elsewhere a line now and then."""

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from rich.console import Console
from rich.progress import Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

EVERY = 15.0
"""Time [s] between lines, where there is no terminal."""

Told = Callable[[str], None]
"""Receives which stage a work has come to."""


@contextmanager
def stages_of(what: str) -> Iterator[Told]:
    """Give what receives the stage of a work, which is shown on the error stream with the time that it takes.

    What `identify` works at in the block is shown, too: model, estimator, iteration.
    """
    from identify.telling import listening

    console = Console(stderr=True)
    if console.is_terminal:
        columns = SpinnerColumn(), TextColumn("{task.description}", markup=False), TimeElapsedColumn()
        with Progress(*columns, console=console, transient=True) as bar:
            task = bar.add_task(what)
            told: Told = lambda stage: bar.update(task, description=f"{what}: {stage}")  # noqa: E731
            with listening(told):
                yield told
        return
    lines = _Lines(console, what)
    try:
        with listening(lines.receive):
            yield lines.receive
    finally:
        lines.done.set()


@contextmanager
def progress_of(what: str) -> Iterator[Callable[[float], None]]:
    """Give what receives the share of a work that is done, and shows it on the error stream."""
    with stages_of(what) as told:
        yield lambda share: told(f"{share:4.0%}")


class _Lines:
    """A line every EVERY seconds, also while a stage takes longer."""

    def __init__(self, console: Console, what: str) -> None:
        self._console, self._what, self._stage, self._start = console, what, "", time.monotonic()
        self.done = threading.Event()
        threading.Thread(target=self._tick, name="idbench-progress", daemon=True).start()

    def receive(self, stage: str) -> None:
        self._stage = stage.strip()

    def _tick(self) -> None:
        while not self.done.wait(EVERY):
            stage, passed = f": {self._stage}" if self._stage else "", time.monotonic() - self._start
            self._console.print(f"{self._what}{stage}, {passed:.0f} s", highlight=False, soft_wrap=True)
