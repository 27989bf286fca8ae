"""Settings that check themselves: every field of a scenario has a type, a range, a unit and a description."""

import ast
import inspect
import tomllib
from functools import cache, wraps
from itertools import pairwise
from pathlib import Path
from textwrap import dedent
from typing import Annotated, Any, TypeVar, dataclass_transform

import numpy as np
import numpy.typing as npt
from pydantic import AllowInfNan, BeforeValidator, ConfigDict, Field, Strict, ValidationError
from pydantic.dataclasses import dataclass

from idbench.identify.plugins import did_you_mean
from idbench.sim.errors import ScenarioError

C = TypeVar("C", bound=type)

_SIGNS = {"gt": ">", "ge": ">=", "lt": "<", "le": "<="}

_CHECKED = ConfigDict(extra="forbid", arbitrary_types_allowed=True)

LARGEST = 1e12  # Size of a number in SI units beyond which it is a slip

Number = Annotated[float, Strict(), AllowInfNan(False), Field(ge=-LARGEST, le=LARGEST)]
Positive = Annotated[Number, Field(gt=0)]
NotNegative = Annotated[Number, Field(ge=0)]
Share = Annotated[Number, Field(ge=0, le=1)]
Whole = Annotated[int, Strict()]
Truth = Annotated[bool, Strict()]
Seed = Annotated[Whole, Field(ge=0, lt=2**63)]


def _as_many(value: object) -> object:
    """Return a single number as a tuple of one: it holds for all joints."""
    return value if value is None or isinstance(value, (list, tuple, np.ndarray)) else (value,)


EachShareError = Annotated[tuple[Annotated[Number, Field(gt=-1, lt=10)], ...], BeforeValidator(_as_many), Field(min_length=1)]
EachNumber = Annotated[tuple[Number, ...], BeforeValidator(_as_many), Field(min_length=1)]
EachPositive = Annotated[tuple[Positive, ...], BeforeValidator(_as_many), Field(min_length=1)]
EachPositiveOrNone = Annotated[tuple[Positive, ...] | None, BeforeValidator(_as_many)]
EachNotNegativeOrNone = Annotated[tuple[NotNegative, ...] | None, BeforeValidator(_as_many)]
EachNotNegative = Annotated[tuple[NotNegative, ...], BeforeValidator(_as_many), Field(min_length=1)]
EachCount = Annotated[tuple[Annotated[Whole, Field(ge=1)], ...], BeforeValidator(_as_many), Field(min_length=1)]
"""One value for all joints, or one per joint; a tuple in either case."""

Positions = tuple[tuple[Number, ...], ...]
"""Waypoints, joint by joint [rad]."""


@dataclass_transform(frozen_default=True)
def settings(cls: C) -> C:
    """Make `cls` a frozen dataclass that checks its fields when it is made; what is wrong is a ScenarioError.

    The docstring below a field is its description. A ValueError of `__post_init__` is reported as well.
    """
    made = dataclass(frozen=True, config=_CHECKED)(cls)
    init = made.__init__

    @wraps(init)
    def checked(self: object, *args: object, **kwargs: object) -> None:
        try:
            init(self, *args, **kwargs)
        except ValidationError as error:
            raise ScenarioError("; ".join(complaints(error, made))) from None

    made.__init__ = checked  # type: ignore[method-assign]  # pydantic's own errors, in our words
    return made  # type: ignore[return-value]


def read_toml(path: Path, what: str, kind: type[Exception] = ScenarioError) -> dict[str, Any]:
    """Return the document of a file of settings; raise an error of a kind that says why `what` cannot be read."""
    try:
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise kind(f"cannot read {what} {path}: {error.strerror}") from error
    except RecursionError as error:
        raise kind(f"cannot read {path}: its tables are nested too deeply") from error
    except (UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        raise kind(f"cannot read {what} {path}: {error}") from error


def make(cls: type, content: object, where: str) -> Any:
    """Return `cls` made of the keys of a table; raise ScenarioError that says where in the scenario it is wrong."""
    if not isinstance(content, dict):
        raise ScenarioError(f"{where} = {content!r:.60} must be a table of settings")
    try:
        return cls.__pydantic_validator__.validate_python(content)  # type: ignore[attr-defined]
    except ValidationError as error:
        raise ScenarioError("; ".join(complaints(error, cls, where))) from None


def complaints(error: ValidationError, cls: type, where: str = "") -> list[str]:
    """Errors, one sentence per setting: its key, its value, what is allowed, the nearest known key."""
    return list(dict.fromkeys(_complaint(detail, cls, where) for detail in error.errors(include_url=False)))


def _complaint(detail: Any, cls: type, where: str) -> str:
    kind, location = detail["type"], list(detail["loc"])
    if not where and location and isinstance(location[0], int):  # an argument by its place: its name says more
        location[0] = [*fields_of(cls), *map(str, range(location[0] + 1))][location[0]]
    owner = _owner(cls, [part for part in location[:-1] if isinstance(part, str)])
    place = "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in location).lstrip(".")  # a.b[0].c
    key = ".".join(filter(None, [where, place]))
    meaning = description(owner, next((part for part in reversed(location) if isinstance(part, str)), ""))
    if kind in ("unexpected_keyword_argument", "unexpected_positional_argument"):
        known = list(fields_of(owner))
        hint = did_you_mean(str(location[-1]), known)
        return f"unknown key {key!r}{hint}; " + (f"known: {', '.join(known)}" if known else "this kind has no settings")
    if kind in ("missing", "missing_argument"):
        return f"key {key!r} is missing" + (f": {meaning}" if meaning else "")
    if kind == "value_error":
        return ": ".join(filter(None, [key, str(detail["ctx"]["error"])]))
    allowed = str(detail["msg"]).replace("Input should be", "must be").replace("Value error, ", "")
    return f"{key} = {detail['input']!r:.60}: {allowed}" + (f" ({meaning})" if meaning else "")


def _owner(cls: type, path: list[str]) -> type:
    """Return the class of settings that a path of keys ends in."""
    for key in path:
        annotation = getattr(fields_of(cls).get(key), "annotation", None)
        parts = (annotation, *getattr(annotation, "__args__", ()))
        cls = next((part for part in parts if hasattr(part, "__pydantic_fields__")), cls)
    return cls


def fields_of(cls: type) -> dict[str, Any]:
    """Return the fields of a class of settings, by name."""
    found: dict[str, Any] = getattr(cls, "__pydantic_fields__", {})
    return found


def description(cls: type, key: str) -> str:
    """Text of a field, with its unit and range, in one line."""
    texts = (_docstrings(owner)[key] for owner in cls.__mro__ if key in _docstrings(owner))
    return " ".join(next(texts, "").split()).rstrip(".")


@cache
def _docstrings(cls: type) -> dict[str, str]:
    """Return the docstrings below the fields of a class; read when they are asked for, since that takes its source."""
    if not hasattr(cls, "__pydantic_fields__"):
        return {}
    (body,) = (node.body for node in ast.parse(dedent(inspect.getsource(cls))).body if isinstance(node, ast.ClassDef))
    return {
        str(ast.unparse(field.target)): ast.literal_eval(below.value)
        for field, below in pairwise(body)
        if isinstance(field, ast.AnnAssign) and isinstance(below, ast.Expr) and isinstance(below.value, ast.Constant)
    }


def for_all_joints(cls: type, key: str) -> bool:
    """True if a single value of this setting holds for all joints."""
    return any(isinstance(m, BeforeValidator) for m in fields_of(cls)[key].metadata)


def limits(cls: type, key: str) -> str:
    """Return the range of a setting, or of each of its values, such as `> 0, <= 1`; empty if there is none."""
    field = fields_of(cls)[key]
    found = [*field.metadata, *_metadata(field.annotation)]
    every = ((sign, getattr(m, name)) for m in found for name, sign in _SIGNS.items() if hasattr(m, name))
    return ", ".join(f"{sign} {bound:g}" for sign, bound in every if abs(bound) < LARGEST)


def _metadata(annotation: Any) -> list[Any]:
    """Annotations of a type and of the types that it is made of."""
    own = [inner for m in getattr(annotation, "__metadata__", ()) for inner in getattr(m, "metadata", [m])]
    return own + [m for part in getattr(annotation, "__args__", ()) for m in _metadata(part)]


def per_joint(values: tuple[float, ...], n: int, name: str) -> npt.NDArray[np.float64]:
    """Return a setting as an array of one value for each of `n` joints; raise ScenarioError if their numbers differ."""
    if len(values) not in (1, n):
        raise ScenarioError(f"{name} has {len(values)} values for {n} joints: give one for all, or one per joint")
    return np.array(np.broadcast_to(np.asarray(values, dtype=np.float64), (n,)))
