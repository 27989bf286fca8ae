"""Errors of the experiments: each says the value, what was allowed and what to try."""

import sys
import tempfile
import traceback
from pathlib import Path


class ExperimentError(Exception):
    """Root of all errors that `experiments` raises on purpose."""


class ResultsError(ExperimentError):
    """A results folder that cannot be written or read."""


class RequirementError(ExperimentError):
    """A complete result that falls short of what was required of it."""


class StudyError(ExperimentError):
    """A study that cannot be run: a file, an axis, a folder, a cluster."""


CONTROL = {code: f"\\x{code:02x}" for code in (*range(32), *range(127, 160)) if chr(code) not in "\n\t"}
CONTROL |= {code: f"\\u{code:04x}" for code in (0x200E, 0x200F, *range(0x202A, 0x202F), *range(0x2066, 0x206A))}
"""Control characters, and those that turn the direction of what follows; what is printed in their place."""

LONGEST = 160  # Characters of a name that are shown


def shortened(name: object) -> str:
    """Return a name, its middle left out if it is very long."""
    text = str(name)
    return text if len(text) <= LONGEST else f"{text[: LONGEST // 2]}...{text[-LONGEST // 4 :]} ({len(text)} characters)"


def visible(text: str) -> str:
    """Return text without control characters, which a terminal would obey."""
    return text.translate(CONTROL)


REPORT = "fault.txt"  # Name of the file of tracebacks in a results folder


def is_told(error: BaseException) -> bool:
    """True if an error says itself what is wrong and what to try; packages that are not loaded have raised none."""
    roots: list[type] = [ExperimentError, OSError, MemoryError]
    for module, name in (("idbench.identify.errors", "IdentificationError"), ("idbench.sim.errors", "BenchError")):
        if module in sys.modules:
            roots.append(getattr(sys.modules[module], name))
    return isinstance(error, tuple(roots))


def reason(error: BaseException) -> str:
    """Message of an error; of a fault its kind, too."""
    if isinstance(error, MemoryError):
        return f"not enough memory{f': {error}' if str(error) else ''}; take a part of the log, or close other programs"
    if isinstance(error, OSError) and not isinstance(error, ExperimentError):
        return ": ".join(filter(None, (error.strerror or str(error), shortened(error.filename or ""))))
    if is_told(error):
        return str(error)
    return f"a fault of idbench, not of your input ({type(error).__name__}: {' '.join(str(error).split())[:200]})"


def trace(error: BaseException) -> str:
    """Return the traceback of an error."""
    return "".join(traceback.format_exception(error))


def report(error: BaseException) -> Path:
    """Write the traceback of an error to a file of its own; return where it is."""
    with tempfile.NamedTemporaryFile("w", prefix="idbench-fault-", suffix=".txt", delete=False, encoding="utf-8") as file:
        file.write(trace(error))
    return Path(file.name)
