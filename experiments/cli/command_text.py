"""A command as it is typed."""

from collections.abc import Iterator
from dataclasses import MISSING, fields, is_dataclass
from shlex import quote
from typing import Any


def command_of(name: str, asked: Any, positional: str, left_out: tuple[str, ...]) -> str:
    """Return what was asked as a command: all that differs from the defaults, but for fields that are left out."""
    given = getattr(asked, positional)
    values = given if isinstance(given, tuple) else (given,)
    words = ["uv run idbench", name, *(quote(str(x)) for x in values), *_options(asked, (positional, *left_out))]
    return " ".join(words)


def _options(part: Any, left_out: tuple[str, ...]) -> Iterator[str]:
    for field in fields(part):
        value = getattr(part, field.name)
        if field.name in left_out or (field.default is not MISSING and value == field.default):
            continue
        if is_dataclass(value):
            yield from _options(value, left_out)
        elif value is True:
            yield f"--{field.name.replace('_', '-')}"
        else:
            several = value if isinstance(value, tuple) else (value,)
            yield " ".join([f"--{field.name.replace('_', '-')}", *(quote(str(x)) for x in several)])
