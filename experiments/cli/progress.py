"""How far a long work is: on a terminal in place, elsewhere a line now and then."""

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Protocol

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

EVERY = 15.0
"""Time [s] between lines, where there is no terminal."""


class Told(Protocol):
    """Receives which stage a work has come to, and which share of it is done if that is known."""

    def __call__(self, stage: str, share: float | None = None) -> None: ...  # noqa: D102


@contextmanager
def stages_of(what: str) -> Iterator[Told]:
    """Give what receives the stage of a work, which is shown on the error stream with the time that it takes.

    What `identify` works at in the block is shown, too: model, estimator, iteration.
    """
    from idbench.identify.telling import listening

    console = Console(stderr=True)
    with _bar(console, what) if console.is_terminal else _lines(console, what) as told, listening(told):
        yield told


@contextmanager
def progress_of(what: str) -> Iterator[Callable[[float], None]]:
    """Give what receives the share of a work that is done, and shows it."""
    with stages_of(what) as told:
        yield lambda share: told(f"{share:4.0%}", share)


@contextmanager
def runs_of(what: str, todo: int) -> Iterator[Callable[[float], None]]:
    """Give what receives how many of `todo` runs are done, and shows it, their rate and the time left."""
    start = time.monotonic()

    def receive(done: float) -> None:
        rate = done / max(time.monotonic() - start, 1e-9)
        rest = f", {rate:.3g} runs/s, {(todo - done) / rate:.0f} s left" if done else ""
        told(f"{done:.0f} of {todo} runs{rest}", done / todo)

    with stages_of(what) as told:
        yield receive


@contextmanager
def _bar(console: Console, what: str) -> Iterator[Told]:
    columns = TextColumn("{task.description}", markup=False), BarColumn(), TimeElapsedColumn()
    with Progress(*columns, console=console, transient=True) as bar:
        task = bar.add_task(what, total=None)

        def receive(stage: str, share: float | None = None) -> None:
            bar.update(task, description=f"{what}: {stage.strip()}", total=None if share is None else 1.0, completed=share)

        yield receive


@contextmanager
def _lines(console: Console, what: str) -> Iterator[Told]:
    """Print a line every EVERY seconds, also while a stage takes longer."""
    done, now, start = threading.Event(), [""], time.monotonic()

    def tick() -> None:
        while not done.wait(EVERY):
            stage = f": {now[0]}" if now[0] else ""
            console.print(f"{what}{stage}, {time.monotonic() - start:.0f} s", highlight=False, soft_wrap=True)

    def receive(stage: str, share: float | None = None) -> None:
        del share
        now[0] = stage.strip()

    threading.Thread(target=tick, name="idbench-progress", daemon=True).start()
    try:
        yield receive
    finally:
        done.set()
