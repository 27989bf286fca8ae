"""A command: its options, and the function that does its work, which is loaded when it is called."""

from collections.abc import Iterator, Sequence
from dataclasses import MISSING, fields, is_dataclass, replace
from importlib import import_module
from pathlib import Path
from shlex import quote
from typing import Any, ClassVar, TypeVar, get_type_hints

from idbench.experiments.cli.interruption import importing
from idbench.experiments.program import program
from idbench.experiments.requests.jobs import request_type
from idbench.experiments.requests.words import word_of

COMMANDS: dict[str, type] = {}  # The commands by name
GROUPS = ("Identify", "Simulate", "Look", "Extend")  # In the list of commands


class Command:
    """Options of a command; calling them does its work."""

    action: ClassVar[str] = ""
    """File of `idbench.experiments.cli.commands` and function, as in logs:show_log; it receives the options."""
    called: ClassVar[str] = ""
    """Name of the command."""
    group: ClassVar[str] = ""
    """Title above it in the list of commands, one of `GROUPS`."""

    def __init_subclass__(cls, called: str = "", action: str = "", group: str = "") -> None:
        if called:
            cls.called, cls.action, cls.group = called, action, group
            COMMANDS[called] = cls

    def __call__(self) -> None:
        """Do the work."""
        module, _, name = self.action.partition(":")
        with importing():
            function = getattr(import_module(f"idbench.experiments.cli.commands.{module}"), name)
        function(self)


def command_of(options: Any, *, out: bool = False, absolute: bool = False) -> str:
    """Command line of a request: all that differs from the defaults, but for what only shows or writes its results.

    `out` names folder and files of the results, too; `absolute` names files from the root: it reads the same ones.
    """
    folder = ["--out", quote(str(options.out))] if out and options.out else []
    written = list(map(quote, map(str, getattr(options, "write", ())))) if out else []
    words = [program(), options.called, *_words(options, request_type(options), absolute), *folder]
    return " ".join([*words, *(["--write", *written] if written else [])])


def _words(part: Any, kind: type, absolute: bool) -> Iterator[str]:
    """Yield the words of a request, or of a group of it: what is typed without a name first."""
    words = {name: word_of(hint) for name, hint in get_type_hints(kind, include_extras=True).items()}
    for field in sorted(fields(kind), key=lambda field: not words[field.name].positional):
        value, word = getattr(part, field.name), words[field.name]
        option = f"--{word.option or field.name.replace('_', '-')}"
        if field.default is not MISSING and value == field.default:
            continue
        if is_dataclass(value):
            yield from _words(value, type(value), absolute)
        elif isinstance(value, bool):
            yield option if value else f"--no-{option[2:]}"
        else:
            several = value if isinstance(value, tuple) else (value,)
            yield from (*([] if word.positional else [option]), *(_word(x, absolute) for x in several))


def _word(value: object, absolute: bool) -> str:
    """Return a value as it is typed."""
    text = str(value)
    named = isinstance(value, Path) or bool(Path(text).suffix)  # other words name what ships, whatever files there are
    try:
        there = absolute and named and Path(text).exists()
    except (OSError, ValueError):  # too long for a name
        there = False
    return quote(str(Path(text).absolute()) if there else text)


Asked = TypeVar("Asked")


def with_own_parts(asked: Asked) -> Asked:
    """Return a request whose models, chains, estimators and laws are names of tables, which have loaded one's own."""
    from idbench.identify import CHAINS, ESTIMATORS, MODELS

    made: Any = asked
    tables: dict[str, Any] = {"model": MODELS, "chain": CHAINS, "estimator": ESTIMATORS}
    named = {name: table.load(value) for name, table in tables.items() if (value := getattr(made, name, None))}
    laws = replace(made.parameters, friction=_loaded(made.parameters.friction), add=_loaded(made.parameters.add))
    return replace(made, parameters=laws, **named)


def _loaded(texts: Sequence[str]) -> tuple[str, ...]:
    return tuple("=".join("+".join(map(_law, part.split("+"))) for part in text.split("=")) for text in texts)


def _law(name: str) -> str:
    """Return the name of a law; what a colon follows is a module unless it is a law with the number of its setting."""
    from idbench.identify import BLOCKS

    module, _, law = name.partition(":")
    return BLOCKS.load(name) if law.isidentifier() and module not in BLOCKS else name
