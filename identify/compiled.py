"""Functions as compiled code, kept for the next process: for loops in which a step needs the one before."""

from collections.abc import Callable
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import Any

from numba import njit


def compiled(function: Callable[..., Any]) -> Any:
    """Return a function as compiled code, kept where there is a place for it; with the same arithmetic as Python."""
    _remove_stale(Path(function.__code__.co_filename).parent)
    try:
        return njit(cache=True, nogil=True)(function)
    except RuntimeError:  # neither the project's folder nor a cache of the user can be written
        return njit(nogil=True)(function)


@cache
def _remove_stale(folder: Path) -> None:
    """Remove compiled code of a folder that is older than any of its sources: what it takes may be defined in another one.

    Of an earlier version numba cannot even read the index.
    """
    with suppress(OSError):  # a folder that cannot be written: nothing was kept there
        newest = max(path.stat().st_mtime for path in folder.glob("*.py"))
        for path in (folder / "__pycache__").glob("*.nb?"):
            if path.stat().st_mtime < newest:
                path.unlink()
