"""Words of a command that it does not take, each said in one line."""

import re
from collections.abc import Container, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import MISSING, dataclass, field, fields, is_dataclass
from difflib import get_close_matches
from inspect import cleandoc
from itertools import takewhile
from types import UnionType
from typing import Annotated, Any, Union, get_args, get_origin, get_type_hints

import tyro
from tyro import _errors as parser  # private: tyro has no other way to say what is wrong in words of one's own
from tyro import _strings  # private: tyro keeps the line breaks of texts that are indented, as ours are
from tyro.constructors import PrimitiveConstructorSpec

from idbench.experiments.errors import ExperimentError
from idbench.experiments.program import program
from idbench.experiments.requests.words import Word


def typed(request: type, shown: Container[str] | None = None) -> type:
    """Return a request with the marks of the library on its fields; the help has all of them, or those that are `shown`."""
    hints = get_type_hints(request, include_extras=True)
    marked = dict[str, Any]()
    defaults = dict[str, Any]()
    for each in fields(request):
        hint = hints[each.name]
        default = each.default
        hidden = shown is not None and each.name not in shown
        made, marks = _plain(hint), _marks(hint, default)
        if (inner := group_of(hint)) is not None:
            made, marks = typed(inner, shown), [tyro.conf.OmitArgPrefixes, tyro.conf.OmitSubcommandPrefixes]
            hidden = shown is not None and not any(f.name in shown for f in fields(inner))
            defaults[each.name] = field(default_factory=made)
        elif default is not MISSING:
            defaults[each.name] = default
        marks += [tyro.conf.Suppress] if hidden else []
        marked[each.name] = Annotated[(made, *marks)] if marks else made
    space = {"__annotations__": marked, "__doc__": request.__doc__, "__module__": request.__module__, **defaults}
    return dataclass(frozen=True, kw_only=True)(type(request.__name__, (request,), space))


def untyped(made: Any) -> Any:
    """Return what the library made as the request that it is."""
    values = {f.name: getattr(made, f.name) for f in fields(made)}
    return type(made).__mro__[1](**{name: untyped(x) if is_dataclass(x) else x for name, x in values.items()})


def group_of(hint: Any) -> Any:
    """Return the dataclass of a group of options, or None of a single one."""
    first = _plain(hint)
    return first if is_dataclass(first) else None


def word_of(hint: Any) -> Word:
    """Return how a value of a type is typed."""
    return next((mark for mark in getattr(hint, "__metadata__", ()) if isinstance(mark, Word)), Word())


def _plain(hint: Any) -> Any:
    return get_args(hint)[0] if get_origin(hint) is Annotated else hint


def _marks(hint: Any, default: object) -> list[Any]:
    """Return what the library knows of a field: metavar, name, the value that one word becomes."""
    word = word_of(hint)
    metavar, unsaid = word.metavar if word.made is None else "", default is None or default == ()
    marks = list[Any]()
    if metavar or word.option or word.short or unsaid:
        said = "" if unsaid else None
        short = [word.short] if word.short else None
        marks.append(tyro.conf.arg(name=word.option or None, aliases=short, metavar=metavar or None, help_behavior_hint=said))
    if word.made is not None:
        marks.append(_one(word))
    if word.positional:
        marks.append(tyro.conf.Positional)
    if word.flag:
        marks.append(tyro.conf.FlagCreatePairsOff)
    return marks


def _one(word: Word) -> PrimitiveConstructorSpec[Any]:
    made = word.made or str
    return PrimitiveConstructorSpec(
        nargs=1,
        metavar=word.metavar,
        instance_from_str=lambda words: made(words[0]),
        is_instance=lambda _: True,
        str_from_instance=lambda value: [] if value is None else [str(value)],
        choices=word.known or None,
    )


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


KINDS: Mapping[type, str] = {int: "a whole number", float: "a number"}  # What options take, in words
CLOSE = 0.7  # Likeness of words from which on one is taken for a slip of the other
COUNTS = ("", "", "two", "three", "four", "five", "six")  # Numbers of values that an option takes


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
    help_ = f"{program()} {name} --help-all" if name in commands else f"{program()} --help"
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
    for each in fields(command):
        hint = hints[each.name]
        if is_dataclass(hint):
            yield from _options(hint)
        else:
            name = each.name.replace("_", "-")
            yield from (f"--{name}", *((f"--no-{name}",) if hint is bool else ()))
