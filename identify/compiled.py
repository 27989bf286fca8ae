"""The compiled part of the package: loops in which a step needs the one before, in C."""

import ctypes
import sys
from functools import cache
from pathlib import Path
from typing import Any

import numpy.typing as npt

from idbench.identify.errors import IdentificationError

SUFFIX = {"win32": ".dll", "darwin": ".dylib"}.get(sys.platform, ".so")


@cache
def library() -> ctypes.CDLL:
    """The compiled functions.

    Raises
    ------
    IdentificationError
        If this installation has none for this platform.
    """
    package = sys.modules[__name__.partition(".")[0]]
    path = Path(str(package.__file__)).with_name("compiled" + SUFFIX)
    try:
        return ctypes.CDLL(str(path))
    except OSError as error:
        raise IdentificationError(
            f"idbench has no compiled code for this platform ({error}): install it from its sources, which needs no compiler: "
            "pip install --force-reinstall --no-binary idbench idbench, or, in a clone, uv sync --reinstall-package idbench"
        ) from error


def function(name: str, *arguments: Any, result: Any = None) -> Any:
    """A compiled function with the types of its arguments and its result."""
    found = library()[name]  # its own each time: types are not shared
    found.argtypes, found.restype = arguments, result
    return found


def pointer(array: npt.NDArray[Any] | None) -> int | None:
    """Address of the first number of a contiguous array; the array must outlive its use."""
    if array is not None and not array.flags.c_contiguous:
        raise AssertionError("compiled code takes contiguous arrays")
    return None if array is None else array.ctypes.data
