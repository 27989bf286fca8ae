"""A command: its options, and the function that does its work, which is loaded when it is called."""

from collections.abc import Iterator, Sequence
from dataclasses import MISSING, fields, is_dataclass, replace
from importlib import import_module
from pathlib import Path
from shlex import quote
from typing import Any, ClassVar, TypeVar, get_type_hints

from idbench.experiments.cli.interruption import importing
from idbench.experiments.cli.parser import word_of
from idbench.experiments.program import program


class Command:
    """Options of a command; calling them does its work."""

    action: ClassVar[str] = ""
    """File of `idbench.experiments.cli.commands` and function, as in logs:show_log; it receives the options."""

    def __init_subclass__(cls, action: str = "") -> None:
        cls.action = action or cls.action

    def __call__(self) -> None:
        """Do the work."""
        module, _, name = self.action.partition(":")
        with importing():
            function = getattr(import_module(f"idbench.experiments.cli.commands.{module}"), name)
        function(self)


def command_of(name: str, options: Any, positional: str, left_out: tuple[str, ...], *, absolute: bool = False) -> str:
    """Command line of a request: all that differs from the defaults, but for fields that are left out.

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
    return " ".join([program(), name, *words, *_options(options, (positional, *left_out), absolute)])


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


Asked = TypeVar("Asked")


def with_own_parts(asked: Asked) -> Asked:
    """Return a request whose models, chains, estimators and laws are names of tables, which have loaded one's own."""
    from idbench.identify import CHAINS, ESTIMATORS, MODELS

    made: Any = asked
    tables: dict[str, Any] = {"model": MODELS, "chain": CHAINS, "estimator": ESTIMATORS}
    given = {name: getattr(made, name, None) for name in tables}
    named: dict[str, Any] = {name: tables[name].load(value) for name, value in given.items() if value}
    laws = replace(made.parameters, friction=_loaded(made.parameters.friction), add=_loaded(made.parameters.add))
    found: Asked = replace(made, parameters=laws, **named)
    return found


def _loaded(texts: Sequence[str]) -> tuple[str, ...]:
    return tuple("=".join("+".join(map(_law, part.split("+"))) for part in text.split("=")) for text in texts)


def _law(name: str) -> str:
    """Return the name of a law; what a colon follows is a module unless it is a law with the number of its setting."""
    from idbench.identify import BLOCKS

    module, _, law = name.partition(":")
    return BLOCKS.load(name) if law.isidentifier() and module not in BLOCKS else name
