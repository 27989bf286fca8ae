"""A command as it is typed."""

from collections.abc import Iterator
from dataclasses import MISSING, fields, is_dataclass
from pathlib import Path
from shlex import quote
from typing import Any, get_type_hints

from idbench.experiments.cli.typed import word_of


def command_of(name: str, options: Any, positional: str, left_out: tuple[str, ...], *, absolute: bool = False) -> str:
    """Return what was asked as a command: all that differs from the defaults, but for fields that are left out.

    Parameters
    ----------
    name : str
        The command's name.
    options : dataclass
        Its options.
    positional : str
        The field that is typed without its name; empty if there is none.
    left_out : tuple of str
        Fields that are left out.
    absolute : bool
        Whether files are named from the root: then the same command reads the same files.
    """
    given = getattr(options, positional) if positional else ()
    values = given if isinstance(given, tuple) else () if given is None else (given,)
    words = [_word(x, absolute) for x in values]
    return " ".join(["uv run idbench", name, *words, *_options(options, (positional, *left_out), absolute)])


def _options(part: Any, left_out: tuple[str, ...], absolute: bool) -> Iterator[str]:
    hints = get_type_hints(type(part), include_extras=True)
    for field in fields(part):
        value = getattr(part, field.name)
        if field.name in left_out or (field.default is not MISSING and value == field.default):
            continue
        option = f"--{word_of(hints[field.name]).option or field.name.replace('_', '-')}"
        if is_dataclass(value):
            yield from _options(value, left_out, absolute)
        elif isinstance(value, bool):
            yield option if value else f"--no-{option[2:]}"
        else:
            several = value if isinstance(value, tuple) else (value,)
            yield " ".join([option, *(_word(x, absolute) for x in several)])


def _word(value: object, absolute: bool) -> str:
    """Return a value as it is typed."""
    text = str(value)
    named = isinstance(value, Path) or bool(Path(text).suffix)  # other words name what ships, whatever files there are
    try:
        there = absolute and named and Path(text).exists()
    except (OSError, ValueError):  # too long for a name
        there = False
    return quote(str(Path(text).absolute()) if there else text)
