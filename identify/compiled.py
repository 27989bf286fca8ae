"""Functions as compiled code, kept for the next process: for loops in which a step needs the one before."""

from collections.abc import Callable
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import Any

from numba import njit


def compiled(function: Callable[..., Any]) -> Any:
    """Return a function as compiled code, kept where there is a place for it; what it does to numbers is IEEE 754's."""
    _remove_stale(Path(function.__code__.co_filename))
    try:
        return njit(cache=True, nogil=True)(function)
    except RuntimeError:  # neither the project's folder nor a cache of the user can be written
        return njit(nogil=True)(function)


@cache
def _remove_stale(source: Path) -> None:
    """Remove compiled code that is older than its source: of an earlier version numba cannot even read the index."""
    with suppress(OSError):  # a folder that cannot be written: nothing was kept there
        for path in (source.parent / "__pycache__").glob(f"{source.stem}.*.nb?"):
            if path.stat().st_mtime < source.stat().st_mtime:
                path.unlink()
