"""Mistakes of plug-ins, reported by the name of the plug-in: what it raised, or what it returned instead of what."""

import sys
import traceback
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import TypeVar

import numpy as np

from idbench.identify.arrays import Array
from idbench.identify.errors import PluginError

T = TypeVar("T")

OURS = ("idbench",)  # Packages whose mistakes are not those of a plug-in

LIBRARIES = frozenset({"numpy", "scipy", "mujoco", "pyarrow", "ruckig", "pydantic"}) | sys.stdlib_module_names
"""Packages that this project calls itself."""


def is_mistake(error: BaseException) -> bool:
    """True if an error is no interruption or termination: those are meant, and a plug-in has no say in them."""
    meant = isinstance(error, KeyboardInterrupt) or _root(type(error).__module__) in OURS
    return isinstance(error, Exception) or not meant


@contextmanager
def blamed() -> Iterator[None]:
    """Turn what the code of another package raises by mistake into a PluginError that names function, file and line.

    Errors that this project raises on purpose pass, and so do its own mistakes.
    """
    try:
        yield
    except BaseException as error:
        ours = _root(type(error).__module__) in OURS
        frame = None if ours or not is_mistake(error) else _foreign(error)
        if frame is None:
            raise
        message = f"{type(error).__name__}: {error}" if str(error) else type(error).__name__
        raise PluginError(f"plug-in {frame.name} raised {message} ({frame.filename}, line {frame.lineno})") from error


def expect_kind(plugin: object, method: str, value: T, kind: type) -> T:
    """Result of a plug-in's method, if it is of a kind; raise PluginError otherwise."""
    if isinstance(value, kind):
        return value
    article = "an" if kind.__name__[0] in "AEIOU" else "a"
    raise PluginError(f"plug-in {type(plugin).__name__}.{method} returned {value!r:.60}, expected {article} {kind.__name__}")


def expect(plugin: object, method: str, value: object, *shapes: Sequence[int]) -> Array:
    """Result of a plug-in's method, an array of one of the shapes; raise PluginError otherwise."""
    if isinstance(value, np.ndarray) and value.shape in shapes and value.dtype.kind in "fiub":
        return value
    given = f"an array of {value.dtype}, shape {value.shape}" if isinstance(value, np.ndarray) else f"{value!r:.60}"
    wanted = " or ".join(str(tuple(shape)) for shape in dict.fromkeys(map(tuple, shapes)))
    raise PluginError(
        f"plug-in {type(plugin).__name__}.{method} returned {given}, expected an array of numbers, shape {wanted}"
    )


def _foreign(error: BaseException) -> traceback.FrameSummary | None:
    """Return the outermost frame that is neither of this project nor of a library that it calls, None if there is none."""
    roots = [_root(frame.f_globals.get("__name__", "")) for frame, _ in traceback.walk_tb(error.__traceback__)]
    frames = zip(roots, traceback.extract_tb(error.__traceback__), strict=True)
    return next((frame for root, frame in frames if root not in OURS and root not in LIBRARIES), None)


def _root(module: str) -> str:
    return module.split(".", maxsplit=1)[0]
