"""Tables of parts that can be exchanged: the names this package knows, and those that users and other packages add."""

import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import fields, is_dataclass
from difflib import get_close_matches
from functools import cached_property
from importlib import import_module
from importlib.metadata import EntryPoint, entry_points
from itertools import count
from typing import Generic, TypeVar

from idbench.identify.blame import is_mistake
from idbench.identify.errors import PluginError, UnknownNameError

T = TypeVar("T")


class Table(Mapping[str, Callable[[], T]], Generic[T]):
    """Name -> factory of one point where parts can be exchanged.

    A factory is called without arguments: a class whose settings all have defaults, or a function.

    Parameters
    ----------
    point : str
        What the parts are, for example ``"models"``.
    kind : type
        What every factory must return an instance of.
    builtin : dict
        The factories of this package.
    check : callable, optional
        Raises if a part that was made is not fit.
    """

    def __init__(
        self, point: str, kind: type[T], builtin: dict[str, Callable[[], T]], check: Callable[[T], None] | None = None
    ) -> None:
        self.point = point
        self.kind: type[T] = kind
        self._builtin, self._check = builtin, check
        self.builtin = tuple(builtin)
        """Names of the parts of this package."""
        self._loaded: dict[str, Callable[[], T]] = {}
        self._objects: dict[str, T] = {}

    def __iter__(self) -> Iterator[str]:
        yield from self._builtin
        yield from self._loaded

    def __len__(self) -> int:
        return len(self._builtin) + len(self._loaded)

    def __getitem__(self, name: str) -> Callable[[], T]:
        factory = self._builtin.get(name) or self._loaded.get(name)
        if factory is None:
            raise UnknownNameError(
                f"no {name!r} among the {self.point}{did_you_mean(str(name), self)}; known: {', '.join(self)}"
            )
        return factory

    def load(self, name: str) -> str:
        """Return a name of this table: the one given, or CLASS of MODULE:CLASS, which the table has from now on.

        Only for names that a user types: a file names no code.

        Raises
        ------
        PluginError
            If the module or the class cannot be imported, or the name is taken.
        """
        module, colon, short = name.partition(":")
        if not colon:
            return name
        if short in self and short not in self._loaded:
            raise PluginError(f"{name}: {short} is built into the {self.point}, or installed: rename the class")
        with _own_mistakes(f"{name} cannot be loaded"):
            self._loaded[short] = getattr(import_module(module), short)
        return short

    def name_of(self, part: T | type[T] | str) -> str:
        """Return the name of a part given as an object, a class or a name; the table has the object from now on.

        Raises
        ------
        PluginError
            If it is not of the kind of this table.
        """
        if isinstance(part, str):
            return part
        with _own_mistakes(f"{part!r:.60} cannot be made without arguments"):
            made = part() if isinstance(part, type) else part
        if not isinstance(made, self.kind):
            raise PluginError(f"{made!r:.60} is none of the {self.point}: give a name, or an object of {self.kind.__name__}")
        for name, factory in {**self._builtin, **self._loaded}.items():
            if _alike(made, self._objects.get(name, factory)):
                return name
        first = _called(made)
        names = (first if k == 1 else f"{first}-{k}" for k in count(1))
        name = next(each for each in names if each not in self)
        self._loaded[name] = lambda: made
        self._objects[name] = made
        return name

    def own(self, part: type[T]) -> str:
        """Return the name of a class; the table has one that it did not know from now on."""
        for name in self:
            if self[name] is part:
                return name
        self._loaded[part.__name__] = part
        return part.__name__

    def require_one(self, name: str) -> None:
        """Raise PluginError if several objects have been given that are called like that: which is meant?"""
        if f"{name}-2" in self._objects:
            raise PluginError(f"{name} of the {self.point} was defined more than once: give the object, not its name")

    def create(self, name: str) -> T:
        """Return the part `name` with its default settings.

        Raises
        ------
        UnknownNameError
            If no part has that name; the message lists the known ones.
        PluginError
            If it cannot be loaded or made, or is not of the kind of this table.
        """
        factory = self[name]
        with _own_mistakes(f"{self.point} plug-in {name!r} cannot be made without arguments"):
            made = factory()
        if not isinstance(made, self.kind):
            raise PluginError(f"{self.point} plug-in {name!r} makes {type(made).__name__}, not {self.kind.__name__}")
        if self._check is not None:
            self._check(made)
        return made

    def summary(self, name: str) -> str:
        """Return the first line of the docstring of part `name`, or why it cannot be used."""
        try:
            self.create(name)
        except PluginError as error:
            return f"({error})"
        return ((self[name].__doc__ or "").strip() or "(undocumented)").splitlines()[0]


class PluginTable(Table[T]):
    """A table to which other packages add, through the entry-point group ``idbench.<point>``; none replaces a built-in name."""

    @cached_property
    def _found(self) -> dict[str, list[EntryPoint]]:
        """Entry points by their names; one that is given twice, word for word, counts once: the search path may repeat."""
        found: dict[str, dict[str, EntryPoint]] = {}
        for entry in entry_points(group=f"idbench.{self.point}"):
            found.setdefault(entry.name, {})[entry.value] = entry
        return {name: list(entries.values()) for name, entries in found.items()}

    @property
    def _foreign(self) -> dict[str, list[EntryPoint]]:
        return {name: entries for name, entries in self._found.items() if name not in self._builtin}

    @property
    def conflicts(self) -> list[str]:
        """What of other packages cannot be used, since its name is taken."""
        own = [(name, entries) for name, entries in self._found.items() if name in self._builtin]
        shared = [(name, entries) for name, entries in self._foreign.items() if len(entries) > 1]
        return [
            *(f"{name} is built in, {_places(entries)} of the same name is not used: rename it" for name, entries in own),
            *(f"{name} is provided by {_places(entries)}: rename or remove all but one" for name, entries in shared),
        ]

    def __iter__(self) -> Iterator[str]:
        yield from super().__iter__()
        yield from sorted(self._foreign)

    def __len__(self) -> int:
        return super().__len__() + len(self._foreign)

    def __getitem__(self, name: str) -> Callable[[], T]:
        if name in self._builtin or name not in self._foreign:
            return super().__getitem__(name)
        entries = self._foreign[name]
        if len(entries) > 1:
            raise PluginError(f"{self.point} plug-in {name!r} is provided by {_places(entries)}: rename or remove all but one")
        (entry,) = entries
        with _own_mistakes(f"plug-in {entry.name!r} ({entry.value}) cannot be loaded"):
            factory: Callable[[], T] = entry.load()
        return factory


def _alike(made: object, other: object) -> bool:
    """True if a table has an object under another's name: the same, or equal to what a class makes by itself."""
    try:
        if isinstance(other, type):
            return type(made) is other and bool(made == other())
        return made is other or (type(made) is type(other) and bool(made == other))
    except (TypeError, ValueError):  # settings that are arrays, or without defaults
        return False


def _called(made: object) -> str:
    """Return the name of an object: its class, and the settings that are not their defaults."""
    known = fields(made) if is_dataclass(made) else ()
    own = [str(getattr(made, each.name)) for each in known if f"{getattr(made, each.name)}" != f"{each.default}"]
    words = ",".join("".join(text.split())[:20] for text in own)
    return type(made).__name__ + (f"({re.sub(r'[^-.,0-9A-Za-z_]', '', words)})" if words else "")


@contextmanager
def _own_mistakes(what: str) -> Iterator[None]:
    """Turn what the code of other packages raises by mistake into an error that says what could not be done."""
    try:
        yield
    except BaseException as error:
        if not is_mistake(error):
            raise
        raise PluginError(f"{what}: {type(error).__name__}: {error}") from error


def did_you_mean(name: str, known: Iterable[str]) -> str:
    """Return the known name that is nearest to one that is not known, as a question; empty if none is near."""
    by_small = {other.lower(): other for other in known}
    near = get_close_matches(name.lower(), list(by_small), 3)
    near.sort(key=lambda other: sorted(other) != sorted(name.lower()))  # letters that changed places are most likely
    return f" (did you mean {by_small[near[0]]!r}?)" if near else ""


def _places(entries: list[EntryPoint]) -> str:
    """Origin of plug-ins: package and object."""
    return " and ".join(sorted(f"{entry.dist.name if entry.dist else '?'} ({entry.value})" for entry in entries))
