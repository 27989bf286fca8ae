"""The help of a command with many options: those that most people need, or all."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields, is_dataclass
from inspect import cleandoc
from typing import Annotated, Any, get_args, get_origin, get_type_hints

import tyro
from tyro import _strings  # private: tyro keeps the line breaks of texts that are indented, as ours are

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
        tyro.cli(_only(options, essential), prog=f"idbench {words[0]}", args=["--help"])
    except SystemExit:
        print(f"{_hidden(options, essential)} more options: idbench {words[0]} {ALL}")  # noqa: T201  # as the parser prints
    return True


def without_short(words: Sequence[str]) -> list[str]:
    """Return words that ask the parser for all of its help."""
    return ["--help" if word == ALL else word for word in words]


def _only(options: type, names: Sequence[str]) -> type:
    """Return the options of a command, those that are not named hidden."""
    hints = get_type_hints(options, include_extras=True)
    shown: dict[str, Any] = {}
    defaults: dict[str, Any] = {}
    for each in fields(options):
        inner = _inner(hints[each.name])
        if each.name in names:
            continue
        if inner is not None and set(names) & {f.name for f in fields(inner)}:
            short = _only(inner, names)
            shown[each.name] = Annotated[short, *get_args(hints[each.name])[1:]]
            defaults[each.name] = field(default_factory=short)
        else:
            shown[each.name] = Annotated[hints[each.name], tyro.conf.Suppress]
            defaults[each.name] = each.default
    space = {"__annotations__": shown, "__doc__": options.__doc__, "__module__": options.__module__, **defaults}
    return dataclass(frozen=True, kw_only=True)(type(options.__name__, (options,), space))


def _inner(hint: Any) -> Any:
    """Return the dataclass of a group of options, or None of a single one."""
    first = get_args(hint)[0] if get_origin(hint) is Annotated else hint
    return first if is_dataclass(first) else None


def _hidden(options: type, names: Sequence[str]) -> int:
    """Return how many options are not shown."""
    hints = get_type_hints(options, include_extras=True)
    count = 0
    for each in fields(options):
        if (inner := _inner(hints[each.name])) is not None:
            count += _hidden(inner, names)
        else:
            count += each.name not in names
    return count
