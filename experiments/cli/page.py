"""What a command prints: kept until everything has gone well, whatever the terminal does."""

import json
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from io import StringIO
from typing import Any, final

from rich.console import Console
from rich.text import Text

from experiments.errors import ExperimentError, ResultsError

WIDTH = 144
"""Characters of a line where no terminal says how many it has."""


@final
class Page(Console):
    """A console that keeps what is printed.

    Parameters
    ----------
    machine : bool
        Whether a program reads standard output: it gets `found` as JSON, and people read the text on the error stream.
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

    def warn(self, groups: Mapping[str, Sequence[str]]) -> None:
        """Print warnings by what they are about, in the order in which to see to them."""
        there = {about: warnings for about, warnings in groups.items() if warnings}
        if len(there) > 1:
            self.print(Text("what to see to, in this order", style="bold"))
        for number, (about, warnings) in enumerate(there.items(), 1):
            if len(there) > 1:
                self.print(Text(f"{number}. {about}"))
            for warning in warnings:
                self.print(Text(f"warning: {warning}"), soft_wrap=True)
        self.found["warnings"] = {**self.found.get("warnings", {}), **there}


def new_page(*, machine: bool = False) -> Page:
    """Return an empty page."""
    return Page(machine=machine)


@contextmanager
def shown(page: Page) -> Iterator[None]:
    """Print what the page holds at the end of the block, also if results cannot be written: it is worth keeping."""
    try:
        yield
    except ResultsError:
        show(page)
        raise
    show(page)


def show(page: Page) -> None:
    """Print what a page holds; raise ExperimentError if that fails."""
    text = page.file.getvalue() if isinstance(page.file, StringIO) else ""
    if page.machine:
        sys.stderr.write(text)
        text = json.dumps(page.found, indent=2, default=str) + "\n"
    if sys.stdout is not None:  # None where it was closed before we began
        try:
            sys.stdout.write(text)
            sys.stdout.flush()
        except BrokenPipeError:
            raise
        except OSError as error:
            raise ExperimentError(f"cannot print: {error.strerror}") from error
