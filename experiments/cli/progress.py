"""How far a long work is: on a terminal in place, elsewhere a line now and then."""

import time
from collections.abc import Iterator
from contextlib import contextmanager

from rich.console import Console

from sim.engine.simulation import Progress

EVERY = 15.0
"""Time [s] between lines, where there is no terminal."""


@contextmanager
def progress_of(what: str) -> Iterator[Progress]:
    """Give what receives the share of a work that is done, and shows it on the error stream; short works show nothing there."""
    console, reported = Console(stderr=True), time.monotonic()

    def show(share: float) -> None:
        nonlocal reported
        if console.is_terminal:
            console.print(f"{what}: {share:4.0%}", end="\r", highlight=False)
        elif time.monotonic() - reported > EVERY:
            reported = time.monotonic()
            console.print(f"{what}: {share:.0%}", highlight=False, soft_wrap=True)

    yield show
    if console.is_terminal:
        console.print(" " * (len(what) + 6), end="\r")
