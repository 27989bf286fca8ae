"""How far a study is: a bar on a terminal, a line now and then elsewhere."""

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from rich.console import Console
from rich.progress import BarColumn, Progress, ProgressColumn, Task, TextColumn, TimeRemainingColumn
from rich.text import Text

from experiments.study.study import Study

EVERY = 30.0
"""Time [s] between lines, where there is no terminal."""


class _Rate(ProgressColumn):
    def render(self, task: Task) -> Text:
        return Text(f"{task.speed:.3g} runs/s" if task.speed else "")


@contextmanager
def watching(study: Study, todo: int) -> Iterator[Callable[[float], None]]:
    """Give what shows how many of `todo` runs are done, at which rate, and the time left."""
    console = Console(stderr=True)
    if console.is_terminal:
        counted = TextColumn("{task.completed:.0f}/{task.total:.0f} runs")
        columns = (TextColumn("{task.description}"), BarColumn(), counted, _Rate(), TimeRemainingColumn())
        with Progress(*columns, console=console, speed_estimate_period=120) as bar:
            task = bar.add_task(study.name, total=todo)
            yield lambda done: bar.update(task, completed=done)
        return
    yield _Lines(console, study.name, todo).receive


class _Lines:
    """A line every EVERY seconds."""

    def __init__(self, console: Console, name: str, todo: int) -> None:
        self._console, self._name, self._todo = console, name, todo
        self._start = self._told = time.monotonic()

    def receive(self, done: float) -> None:
        """Say how far it is, if it is time to."""
        if time.monotonic() - self._told > EVERY:
            self._told = time.monotonic()
            self.say(done)

    def say(self, done: float) -> None:
        """Say how far it is."""
        passed = time.monotonic() - self._start
        left = f", {passed * (self._todo / done - 1):.0f} s left" if done else ""
        self._console.print(f"{self._name}: {done:.0f} of {self._todo} runs{left}", highlight=False, soft_wrap=True)
