"""Words of a command that it does not take, each said in one line."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import fields, is_dataclass
from difflib import get_close_matches
from itertools import takewhile
from types import UnionType
from typing import Any, Union, get_args, get_origin, get_type_hints

from tyro import _errors as parser  # private: tyro has no other way to say what is wrong in words of one's own

from idbench.experiments.errors import ExperimentError

KINDS: Mapping[type, str] = {int: "a whole number", float: "a number"}
"""What options take, in words."""

CLOSE = 0.7
"""Likeness of words from which on one is taken for a slip of the other."""

COUNTS = ("", "", "two", "three", "four", "five", "six")
"""Numbers of values that an option takes."""


@contextmanager
def refused(words: Sequence[str], commands: Mapping[str, type]) -> Iterator[None]:
    """Turn errors of the parser into ExperimentErrors of one line."""

    def refuse(event: parser.ParseErrorEvent) -> None:
        raise ExperimentError(_said(event, words, commands))

    with parser.on_parse_error(refuse):
        yield


def require_command(words: Sequence[str], commands: Mapping[str, type]) -> None:
    """Raise ExperimentError if the first word is no command."""
    if words[0] in commands or words[0] in ("-h", "--help"):
        return
    if words[0].startswith("-"):
        raise ExperimentError(f"{words[0]}: name a command first; known: {', '.join(commands)}")
    raise ExperimentError(f"no command {words[0]!r}{did_you_mean(words[0], commands)}; known: {', '.join(commands)}")


def require_once(words: Sequence[str]) -> None:
    """Raise ExperimentError if an option is given twice: the parser would take the last, and drop the others."""
    places = [k for k, word in enumerate(words) if word.startswith("--") and word != "--"]
    options = [words[k].partition("=")[0].replace("_", "-") for k in places]
    if twice := next((option for k, option in enumerate(options) if option in options[:k]), None):
        given = [_given(twice, words[k:]) for k, option in zip(places, options, strict=True) if option == twice]
        once = " ".join([twice, *(value for values in given for value in values)])
        raise ExperimentError(f"{twice} is given twice: give it once, and all its values if it takes several: {once}")


def _said(event: parser.ParseErrorEvent, words: Sequence[str], commands: Mapping[str, type]) -> str:
    """Return what is wrong, and what to type instead."""
    name = words[0]
    help_ = f"uv run idbench {name} --help-all" if name in commands else "uv run idbench --help"
    match event:
        case parser.InvalidChoice():
            known = sorted(choice for choice in event.choices if choice != "None")
            hint = did_you_mean(event.value, known)
            said = f"{_called(event.argument)} {event.value}: no such choice{hint}; known: {', '.join(known)}"
        case parser.InstantiationFailure() if event.argument is not None:
            option = _called(event.argument)
            given = " ".join([option, *_given(option, words)])
            said = f"{given}: give {_wanted(event.argument)}: {_help(event.argument)}"
        case parser.BadValue():
            said = f"{_called(event.argument)} needs {_wanted(event.argument)}: {help_} tells more"
        case parser.MissingArgs():
            missing = ", ".join(_called(each.arg) for each in event.missing_arguments)
            said = f"{name} needs {missing}; {help_} tells more"
        case parser.UnrecognizedArgs():
            said = _unknown(event.tokens[0], name, commands) + help_ + " lists all"
        case _:
            said = f"{' '.join(words)}: {getattr(event, 'message', type(event).__name__)}; {help_} tells more"
    return said


def _unknown(word: str, name: str, commands: Mapping[str, type]) -> str:
    """Return which word a command does not know."""
    if not word.startswith("-"):
        return f"{name} takes no further word {word!r}: "
    options = sorted(_options(commands[name])) if name in commands else ["--help", "--version"]
    return f"{name} has no option {word}{did_you_mean(word.partition('=')[0], options)}; "


def did_you_mean(word: str, known: Iterable[str]) -> str:
    """Return the nearest known word as a question, as `idbench.identify.plugins` does, which loads NumPy."""
    near = get_close_matches(word.lower(), list(known), 1, CLOSE)
    return f" (did you mean {near[0]!r}?)" if near else ""


def _called(argument: Any) -> str:
    return str(argument.field.intern_name) if argument.is_positional() else str(argument.lowered.name_or_flags[0])


def _help(argument: Any) -> str:
    """Return what an option is, in one line."""
    text = argument.field.helptext
    return " ".join(str((text() if callable(text) else text) or "").split())


def _given(option: str, words: Sequence[str]) -> list[str]:
    """Return the words that were given to an option."""
    plain = [word.replace("_", "-") if word.startswith("--") else word for word in words]
    for k, word in enumerate(plain):
        if word == option:
            return list(takewhile(lambda w: not w.startswith("--"), words[k + 1 :]))
        if word.startswith(f"{option}="):
            return [words[k].partition("=")[2]]
    return []


def _wanted(argument: Any) -> str:
    """Return what an option takes, in words."""
    stated = argument.field.type_stripped
    union = get_origin(stated) in (Union, UnionType)
    types = [t for t in (get_args(stated) if union else (stated,)) if t is not type(None)]
    inner = get_args(types[0]) or tuple(types)
    kind = next((t for t in inner if t in KINDS), None)
    if kind is None:
        return str(argument.lowered.metavar)
    if len(inner) > 1 and inner[-1] is not Ellipsis:
        return f"{COUNTS[len(inner)]} {KINDS[kind].split()[-1]}s"
    several = Ellipsis in inner or argument.lowered.nargs == "*"
    return f"{KINDS[kind].removeprefix('a ')}s" if several else KINDS[kind]


def _options(command: Any) -> Iterator[str]:
    """Yield the options of a command, those of its groups, too."""
    hints = get_type_hints(command)
    for field in fields(command):
        hint = hints[field.name]
        if is_dataclass(hint):
            yield from _options(hint)
        else:
            name = field.name.replace("_", "-")
            yield from (f"--{name}", *((f"--no-{name}",) if hint is bool else ()))
