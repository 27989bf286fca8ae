"""What a command prints: kept until everything has gone well, whatever the terminal does."""

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from io import StringIO

from rich.console import Console

from experiments.errors import ExperimentError, ResultsError

WIDTH = 144
"""Characters that the widest table needs."""


def new_page() -> Console:
    """Return a console that keeps what is printed: it is shown when everything has gone well, whatever the terminal does."""
    terminal = Console()
    return Console(
        file=StringIO(),
        width=max(terminal.width, WIDTH),
        force_terminal=terminal.is_terminal,
        highlight=False,
        markup=False,
        emoji=False,
    )


@contextmanager
def shown(page: Console) -> Iterator[None]:
    """Print what the page holds at the end of the block, also if results cannot be written: it is worth keeping."""
    try:
        yield
    except ResultsError:
        show(page)
        raise
    show(page)


def show(page: Console) -> None:
    """Print what a page holds; raise ExperimentError if that fails."""
    if sys.stdout is not None and isinstance(page.file, StringIO):  # None where it was closed before we began
        try:
            sys.stdout.write(page.file.getvalue())
            sys.stdout.flush()
        except BrokenPipeError:
            raise
        except OSError as error:
            raise ExperimentError(f"cannot print: {error.strerror}") from error
