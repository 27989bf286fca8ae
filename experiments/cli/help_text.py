"""The help of a command with many options: those that most people need, or all."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import fields
from inspect import cleandoc
from typing import get_type_hints

import tyro
from tyro import _strings  # private: tyro keeps the line breaks of texts that are indented, as ours are

from idbench.experiments.cli.typed import group_of, typed

ALL = "--help-all"
HELP = ("-h", "--help")


def _joined(helptext: str) -> str:
    """Return a text with its paragraphs in one line each."""
    return re.sub(r"(?<!\n)\n(?!\n)", " ", cleandoc(helptext))


_strings.remove_single_line_breaks = _joined


def show_help(words: Sequence[str], commands: Mapping[str, type]) -> bool:
    """Print the short help of a command that has one, and return whether it was asked for."""
    options = commands.get(words[0])
    essential: tuple[str, ...] = getattr(options, "essential", ())
    if options is None or not essential or not set(words[1:]) & set(HELP):
        return False
    try:
        tyro.cli(typed(options, essential), prog=f"idbench {words[0]}", args=["--help"])
    except SystemExit:
        print(f"{_hidden(options, essential)} more options: idbench {words[0]} {ALL}")  # noqa: T201  # as the parser prints
    return True


def without_short(words: Sequence[str]) -> list[str]:
    """Return words that ask the parser for all of its help."""
    return ["--help" if word == ALL else word for word in words]


def _hidden(options: type, names: Sequence[str]) -> int:
    """Return how many options are not shown."""
    hints = get_type_hints(options, include_extras=True)
    count = 0
    for each in fields(options):
        if (inner := group_of(hints[each.name])) is not None:
            count += _hidden(inner, names)
        else:
            count += each.name not in names
    return count
