"""What a command prints: shown as soon as it is complete, whatever becomes of the rest."""

import builtins
import json
import re
import sys
import threading
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, contextmanager, nullcontext
from io import StringIO
from typing import Any, Protocol, TextIO

from rich.console import Console, ConsoleOptions, RenderableType
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn
from rich.segment import Segment
from rich.text import Text

from idbench.experiments.errors import ExperimentError, visible

EVERY = 15.0  # Time [s] between lines at the least, where there is no terminal
LONGEST = 55.0  # Time [s] of a stage without a line


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


def watched(context: Callable[[], AbstractContextManager[Any]], otherwise: Any = None) -> AbstractContextManager[Any]:
    """Context that shows the progress of a call of Python where somebody types, in a notebook or at a prompt."""
    return context() if hasattr(builtins, "__IPYTHON__") or hasattr(sys, "ps1") else nullcontext(otherwise)


@contextmanager
def runs_of(what: str, todo: int) -> Iterator[Callable[[float], None]]:
    """Give what receives how many of `todo` runs are done, and shows it, their rate and the time left."""
    start = time.monotonic()

    def receive(done: float) -> None:
        rate = done / max(time.monotonic() - start, 1e-9)
        rest = f", {rate:.3g} runs/s, {(todo - done) / rate:.0f} s left" if done >= 1 else ""
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
    """Print a line where the stage has changed, looked at every EVERY seconds; one that takes longer has a line a minute."""
    done = threading.Event()
    now: list[str] = [""]
    last: list[Any] = [None, 0.0]
    start = time.monotonic()

    def tick() -> None:
        while not done.wait(EVERY):
            words, seconds = re.sub(r"[\d.,%]+", "", now[0]), time.monotonic() - start
            if words != last[0] or seconds - last[1] > LONGEST:
                last[:] = words, seconds
                stage = f": {now[0]}" if now[0] else ""
                console.print(f"{what}{stage}, {seconds:.0f} s", highlight=False, soft_wrap=True)

    def receive(stage: str, share: float | None = None) -> None:
        del share
        now[0] = stage.strip()

    threading.Thread(target=tick, name="idbench-progress", daemon=True).start()
    try:
        yield receive
    finally:
        done.set()


WIDTH = 144  # Characters of a line where no terminal says how many it has

NOT_SAVED = "not saved: --out FOLDER keeps it, with a report and a recording"  # What is said where nobody named a folder


class Page(Console):
    """A console that keeps what is printed until it is shown; what cannot be shown is reported at the end.

    `contextlib.closing` shows it at the end of a block, however that ends: it is worth keeping. Of a `machine`, a program reads
    standard output: it gets `found` as JSON, and people read the text on the error stream.
    """

    def __init__(self, *, machine: bool = False) -> None:
        terminal = Console(stderr=machine)
        super().__init__(
            file=StringIO(),
            width=terminal.width if terminal.is_terminal else max(terminal.width, WIDTH),
            force_terminal=terminal.is_terminal,
            highlight=False,
            markup=False,
            emoji=False,
        )
        self.machine, self.found = machine, dict[str, Any]()
        self._failure = ""
        self._gone = False
        self._ended = False

    @property
    def encoding(self) -> str:
        """The encoding of what people read: tables have plain lines where it lacks others."""
        return (getattr(self._people, "encoding", None) or "utf-8").lower()

    @property
    def _people(self) -> TextIO | None:
        return sys.stderr if self.machine else sys.stdout

    def render(self, renderable: RenderableType, options: ConsoleOptions | None = None) -> Iterable[Segment]:
        """Return segments without control characters: names come from files of others."""
        for text, style, control in super().render(renderable, options):
            yield Segment(text if control else visible(text), style, control)

    def warn(self, groups: Mapping[str, Sequence[str]]) -> None:
        """Print warnings by what they are about, in the order in which to check them, each once on a page."""
        kept: dict[str, list[str]] = self.found.setdefault("warnings", {})
        said, there = {warning for warnings in kept.values() for warning in warnings}, dict[str, list[str]]()
        for about, warnings in groups.items():
            if new := [warning for warning in dict.fromkeys(warnings) if warning not in said]:
                there[about] = new
                said.update(new)
        if len(there) > 1:
            self.print(Text("Check these first, in this order:", style="bold"))
        for number, (about, warnings) in enumerate(there.items(), 1):
            kept.setdefault(about, []).extend(warnings)
            for k, warning in enumerate(warnings):
                first = f"{number}. {about}: " if k == 0 else "   "
                self.print(Text(f"{first if len(there) > 1 else 'warning: '}{warning}"), soft_wrap=True)

    def show(self) -> None:
        """Show what has been printed since the last time."""
        assert isinstance(self.file, StringIO)
        text = self.file.getvalue()
        self.file.seek(0)
        self.file.truncate()
        self._write(self._people, "\n".join(line.rstrip(" ") for line in text.split("\n")))  # tables fill up their columns

    def end(self) -> None:
        """Show the rest, and what a program reads."""
        self.show()
        if self.machine and self.found and not self._ended:
            self._write(sys.stdout, json.dumps(self.found, indent=2, default=str) + "\n")
        self._ended = True

    def close(self) -> None:
        """End the page; raise ExperimentError if something could not be shown."""
        self.end()
        if self._failure:
            failure, self._failure = self._failure, ""
            raise ExperimentError(f"cannot print: {failure}")

    def _write(self, stream: TextIO | None, text: str) -> None:
        if stream is None or self._gone or not text:  # None where it was closed before we began
            return
        text = text.encode("utf-8", "surrogateescape").decode("utf-8", "backslashreplace")  # names of files need not be UTF-8
        encoding = getattr(stream, "encoding", None) or "utf-8"
        try:
            stream.write(text.encode(encoding, "replace").decode(encoding))
            stream.flush()
        except BrokenPipeError:  # its reader has had enough, as `head` has: nobody is to be told
            self._gone = True
        except OSError as error:
            self._failure = str(error.strerror)
