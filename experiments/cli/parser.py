"""Words of a command become its options; what is wrong with them is said in one line."""

import ast
import re
from collections.abc import Container, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import MISSING, dataclass, field, fields, is_dataclass
from difflib import get_close_matches
from inspect import cleandoc, getsource
from itertools import pairwise, takewhile
from pathlib import Path
from textwrap import dedent
from types import UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin, get_type_hints

from cyclopts import App, Group, Parameter
from cyclopts.exceptions import CoercionError, CycloptsError, MissingArgumentError, UnknownOptionError, UnusedCliTokensError

from idbench.experiments.cli.command import GROUPS
from idbench.experiments.errors import ExperimentError
from idbench.experiments.program import program
from idbench.experiments.requests.words import Word, plain_of, request_keys, word_of

ALL = "--help-all"
HELP = ("-h", "--help")
KINDS: Mapping[type, str] = {int: "a whole number", float: "a number"}  # What options take, in words
COUNTS = ("", "", "two", "three", "four", "five", "six")  # Numbers of values that an option takes
CLOSE = 0.7  # Likeness of words from which on one is taken for a slip of the other


Names = Mapping[str, Sequence[str]]
"""Names that may stand in the place of a file, or of something of one's own, by the field."""

NAMES: Names = {}  # Only a completion has them: it takes the time of loading what they are of


def app_of(name: str, options: type, shown: Container[str] | None = None, place: int = 0, names: Names = NAMES) -> App:
    """The command of a class of options; its help has all of them, or those that are `shown`, a completion `names`."""
    app = _app(name, options.__doc__ or "", "Help", place)
    marked = _marked(options, shown, Group("Options"), names)

    def made(asked: Annotated[marked, Parameter(name="*")]) -> Any:  # type: ignore[valid-type]
        return _unmarked(asked)

    if all(each.default is not MISSING or each.default_factory is not MISSING for each in fields(marked)):
        made.__defaults__ = (marked(),)
    app.default(made)
    return app


def _app(name: str, text: str, title: str, place: int = 0) -> App:
    return App(
        name,
        joined(text),
        help_format="plaintext",
        version_flags=(),
        result_action="return_value",
        group_commands=Group(title, sort_key=9),
        sort_key=place,
    )


def joined(text: str) -> str:
    """A text with its paragraphs in one line each."""
    return re.sub(r"(?<!\n)\n(?!\n)", " ", cleandoc(text))


def texts_of(options: type) -> dict[str, str]:
    """Texts below the fields of a dataclass, by the fields."""
    found = dict[str, str]()
    for owner in filter(is_dataclass, reversed(options.__mro__)):
        (made,) = ast.parse(dedent(getsource(owner))).body
        for each, below in pairwise(made.body if isinstance(made, ast.ClassDef) else []):
            if isinstance(each, ast.AnnAssign) and isinstance(below, ast.Expr) and isinstance(below.value, ast.Constant):
                found[ast.unparse(each.target)] = joined(str(below.value.value))
    return found


def _marked(options: type, shown: Container[str] | None, group: Group, names: Names) -> type:
    """A class of options with the marks of the library on its fields; those that are typed without a name come first."""
    hints = get_type_hints(options, include_extras=True)
    texts = texts_of(options)
    annotations = dict[str, Any]()
    space = dict[str, Any]()
    for each in fields(options):
        hint = hints[each.name]
        word = word_of(hint)
        plain, whole = plain_of(hint), _stated(hint) is int
        if hasattr(plain, "__dataclass_fields__"):
            of = Group(f"Options: {each.name}", help=texts.get(each.name) or plain.__doc__, sort_key=5)
            annotations[each.name] = Annotated[_marked(plain, shown, of, names), Parameter(name="*")]
            space[each.name] = field(default_factory=get_args(annotations[each.name])[0], kw_only=True)
            continue
        several = get_origin(plain) is tuple
        if known := names.get(each.name):
            choice: Any = Literal[tuple(known)]
            plain = tuple[choice, ...] if several else choice
        parameter = Parameter(
            name=_names(each.name, word) or None,
            help=texts.get(each.name),
            metavar=word.metavar or None,
            negative=None if plain is bool and not word.flag else (),
            consume_multiple=(1, None) if several else None,
            converter=(lambda _, tokens: int(tokens[0].value)) if whole else None,  # 2.5 is none
            n_tokens=1 if whole else None,
            allow_repeating=None if several else True,
            json_list=False,
            group=group,
            show=shown is None or each.name in shown,
            show_default=_default if each.default not in (None, (), "", MISSING, False) else False,
            show_choices=get_origin(plain) is Literal,
        )
        annotations[each.name] = Annotated[plain, parameter]
        space[each.name] = field(default=each.default, kw_only=not word.positional)
    space |= {"__annotations__": annotations, "__doc__": options.__doc__, "__module__": options.__module__}
    made: Any = dataclass(frozen=True)(type(options.__name__, (options,), space))
    made.__dataclass_fields__ = dict(sorted(made.__dataclass_fields__.items(), key=lambda each: each[1].kw_only is True))
    return made


def _stated(hint: Any) -> Any:
    """The type of a value that is given: without None."""
    plain = plain_of(hint)
    kinds = get_args(plain) if get_origin(plain) in (Union, UnionType) else (plain,)
    return next(kind for kind in kinds if kind is not type(None))


def _default(value: Any) -> str:
    return " ".join(map(str, value)) if isinstance(value, tuple) else str(value)


def _unmarked(made: Any) -> Any:
    """Options as the class that they are."""
    values = {f.name: getattr(made, f.name) for f in fields(made)}
    return type(made).__mro__[1](**{name: _unmarked(x) if is_dataclass(x) else x for name, x in values.items()})


def every_command(commands: Mapping[str, type], description: str, names: Names = NAMES) -> App:
    """All commands as one, in groups; a completion has `names`."""
    every, groups = _app("idbench", description, "Help"), {title: Group(title, sort_key=k) for k, title in enumerate(GROUPS)}
    for place, (name, options) in enumerate(commands.items()):
        app = app_of(name, options, None, place, names)
        app.group = groups[getattr(options, "group", GROUPS[0])]
        every.command(app)
    return every


def parsed(words: Sequence[str], commands: Mapping[str, type], description: str) -> Any:
    """The options that words name, or None if they asked for help, which is shown.

    Raises
    ------
    ExperimentError
        If something is wrong with the words: it says what to type instead.
    """
    _require_command(words, commands)
    if words[0] in HELP:
        every_command(commands, description).help_print([])
        return None
    name, rest = words[0], list(words[1:])
    options = commands[name]
    essential: tuple[str, ...] = getattr(options, "essential", ())
    asked = {ALL, *HELP} & set(rest)
    app = app_of(f"idbench {name}", options, essential or None if ALL not in asked else None)
    if asked:
        app.help_print([])
        if essential and ALL not in asked:
            print(f"{sum(key not in essential for key in request_keys(options))} more options: idbench {name} {ALL}")  # noqa: T201  # as the library prints
        return None
    _require_once(rest)
    _require_values(rest, options)
    try:
        try:
            return _made(app, rest)
        except MissingArgumentError:
            if rest and not rest[-1].startswith("-"):
                with suppress(CycloptsError):  # an option of several words has taken the last one, which has no name
                    return _made(app, [rest[-1], *rest[:-1]])
            raise
    except CycloptsError as error:
        raise ExperimentError(_said(error, words, options)) from None


def _made(app: App, words: Sequence[str]) -> Any:
    made, bound, _ = app.parse_args(words, exit_on_error=False, print_error=False)
    return made(*bound.args, **bound.kwargs)


def _require_command(words: Sequence[str], commands: Mapping[str, type]) -> None:
    if words[0] in commands or words[0] in HELP:
        return
    if words[0].startswith("-"):
        raise ExperimentError(f"{words[0]}: name a command first; known: {', '.join(commands)}")
    raise ExperimentError(f"no command {words[0]!r}{did_you_mean(words[0], commands)}; known: {', '.join(commands)}")


def _require_once(words: Sequence[str]) -> None:
    """Raise ExperimentError if an option is given twice: the values of the first would be lost, or joined."""
    words = list(takewhile(lambda word: word != "--", words))
    places = [k for k, word in enumerate(words) if word.startswith("--")]
    options = [words[k].partition("=")[0].replace("_", "-") for k in places]
    if twice := next((option for k, option in enumerate(options) if option in options[:k]), None):
        given = [_given(twice, words[k:]) for k, option in zip(places, options, strict=True) if option == twice]
        once = " ".join([twice, *(value for values in given for value in values)])
        raise ExperimentError(f"{twice} is given twice: give it once, and all its values if it takes several: {once}")


def _require_values(words: Sequence[str], options: type) -> None:
    """Raise ExperimentError if a switch is given a value, or the word none stands for a value that is left out."""
    kinds = dict(_options(options))
    for option, word in pairwise(words):
        kind = kinds.get(option, str)
        if word.lower() in ("none", "null") and type(None) in get_args(kind) and _stated(kind) not in (str, Path):
            raise ExperimentError(f"{option} {word}: leave {option} out instead")
    switches = {name for name, hint in kinds.items() if hint is bool}
    if given := next((w for w in words if "=" in w and w.partition("=")[0].replace("_", "-") in switches), None):
        raise ExperimentError(f"{given}: {given.partition('=')[0]} takes no value")


def _said(error: CycloptsError, words: Sequence[str], options: type) -> str:
    """What is wrong, and what to type instead."""
    name, argument = words[0], error.argument
    help_ = f"{program()} {name} {ALL}"
    if isinstance(error, UnknownOptionError):
        known = [option for option, _ in _options(options)]
        word = str(error.token.keyword or error.token.value)
        return f"{name} has no option {word}{did_you_mean(word, known)}; {help_} lists all"
    if isinstance(error, UnusedCliTokensError):
        return f"{name} takes no further word {(error.unused_tokens or ['?'])[0]!r}: {help_} lists all"
    if argument is None:
        return f"{' '.join(words)}: {' '.join(str(error).split())}; {help_} tells more"
    called, kind = _called(argument), _stated(argument.hint)
    if isinstance(error, CoercionError) and error.token is not None and get_origin(kind) is Literal:
        value, known = error.token.value, [str(x) for x in get_args(kind)]
        said = f"{called} {value}: no such choice{did_you_mean(value, known)}; known: {', '.join(sorted(known))}"
    elif isinstance(error, CoercionError) or _given(called, words[1:]):
        given = " ".join([called, *_given(called, words)])
        said = f"{given}: give {_wanted(argument)}: {' '.join(str(argument.parameter.help).split())}"
    elif isinstance(error, MissingArgumentError) and not argument.tokens and not error.keyword:
        required = [each.name for each in fields(options) if each.default is MISSING and each.default_factory is MISSING]
        rest = required[required.index(called) :] if called in required and len(words) == 1 else [called]
        said = f"{name} needs {', '.join(rest)}; {help_} tells more"
    else:
        said = f"{called} needs {_wanted(argument)}: {help_} tells more"
    return said


def did_you_mean(word: str, known: Iterable[str]) -> str:
    """The nearest known word as a question, as `idbench.identify.plugins` makes it, which loads NumPy."""
    near = get_close_matches(word.partition("=")[0].lower(), list(known), 1, CLOSE)
    return f" (did you mean {near[0]!r}?)" if near else ""


def _called(argument: Any) -> str:
    named = argument.field_info.kind.name == "KEYWORD_ONLY"
    return str(argument.name) if named else str(argument.keys[-1] if argument.keys else argument.name)


def _given(option: str, words: Sequence[str]) -> list[str]:
    """The words that were given to an option."""
    plain = [word.replace("_", "-") if word.startswith("--") else word for word in words]
    for k, word in enumerate(plain):
        if word == option:
            return list(takewhile(lambda w: not w.startswith("--"), words[k + 1 :]))
        if word.startswith(f"{option}="):
            return [words[k].partition("=")[2]]
    return []


def _wanted(argument: Any) -> str:
    """What an option takes, in words."""
    kind = _stated(argument.hint)
    inner = get_args(kind) or (kind,)
    number = next((t for t in inner if t in KINDS), None)
    if get_origin(kind) is Literal:
        return " or ".join(map(str, inner))
    if number is None:
        return str(argument.parameter.metavar or getattr(kind, "__name__", kind).upper())
    if len(inner) > 1 and inner[-1] is not Ellipsis:
        return f"{COUNTS[len(inner)]} {KINDS[number].split()[-1]}s"
    return f"{KINDS[number].removeprefix('a ')}s" if Ellipsis in inner else KINDS[number]


def _options(command: Any) -> Iterator[tuple[str, Any]]:
    """The options of a command and their types, those of its groups, too."""
    for key, (_, hint) in request_keys(command).items():
        word, plain = word_of(hint), plain_of(hint)
        if not word.positional:
            names = _names(key, word)
            off = [f"--no-{names[0][2:]}"] if plain is bool and not word.flag else []
            yield from ((option, plain) for option in (*names, *off))


def _names(field_name: str, word: Word) -> list[str]:
    """Names of an option; none of what is typed without a name."""
    own = [] if word.positional else [f"--{word.option or field_name.replace('_', '-')}"]
    return [*own, *filter(None, [word.short])]
