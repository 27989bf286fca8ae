"""Whether what a file says that it holds fits into memory: some kilobytes may unpack to terabytes."""

import os
from pathlib import Path

from idbench.identify.errors import LogError

COPIES = 3
"""How often the values of a log are in memory at once while it is read and turned into SI."""


def require_room(path: Path, what: str, size: int) -> None:
    """Raise LogError if the values of a file, of so many bytes, are more than this process can hold."""
    if (needed := 1e-9 * COPIES * size) > (room := memory()):
        raise LogError(
            f"{path} says that it holds {what}: reading them takes {needed:.3g} GB, and there are {room:.3g} GB: cut the log"
        )


def memory() -> float:
    """Return the memory that this process may have [GB]: of the machine, or its limit; infinity where nobody says."""
    try:
        found = 1e-9 * os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    except (AttributeError, ValueError, OSError):
        found = float("inf")
    try:
        import resource
    except ImportError:  # not on Windows
        return found
    limit, _ = resource.getrlimit(resource.RLIMIT_AS)
    return found if limit == resource.RLIM_INFINITY else min(found, 1e-9 * limit)
