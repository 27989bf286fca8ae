"""Requests as the library of the command line reads them: the only file that knows how it calls a value."""

from collections.abc import Container
from dataclasses import MISSING, dataclass, field, fields, is_dataclass
from typing import Annotated, Any, get_args, get_origin, get_type_hints

import tyro
from tyro.constructors import PrimitiveConstructorSpec

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
    if metavar or word.option or unsaid:
        said = "" if unsaid else None
        marks.append(tyro.conf.arg(name=word.option or None, metavar=metavar or None, help_behavior_hint=said))
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
