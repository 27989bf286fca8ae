"""Requests from tables of keys: TOML files and keyword arguments; every value is checked by the type of its field."""

from collections.abc import Container, Mapping
from dataclasses import fields, replace
from pathlib import Path
from typing import Any, TypeVar

from pydantic import ConfigDict, TypeAdapter, ValidationError

from idbench.experiments.errors import ExperimentError
from idbench.experiments.requests.words import plain_of, request_keys
from idbench.identify.plugins import did_you_mean

Request = TypeVar("Request")


def request_from(request: type[Request], table: Mapping[str, Any], where: str, taken: Container[str] = ()) -> Request:
    """Return a request with the values of a table, which messages call `where`.

    Keys that are `taken` are none of the table.

    Raises
    ------
    ExperimentError
        If a key is unknown, or a value not of its type: it names the value and what is allowed.
    """
    known = {key: place for key, place in request_keys(request).items() if key not in taken}
    values, groups = dict[str, Any](), dict[str, dict[str, Any]]()
    for key, value in table.items():
        if key not in known:
            raise ExperimentError(f"{where}: unknown key {key!r}{did_you_mean(key, known)}; known: {', '.join(known)}")
        place, hint = known[key]
        checked = _checked(f"{where}: {key}", hint, value)
        (groups.setdefault(place[0], {}) if len(place) > 1 else values)[place[-1]] = checked
    defaults = {f.name: f.default for f in fields(request)}  # type: ignore[arg-type]  # a dataclass
    return request(**values, **{name: replace(defaults[name], **inner) for name, inner in groups.items()})  # type: ignore[type-var]


def _checked(where: str, hint: Any, value: Any) -> Any:
    """Return a value as the type of its field has it.

    One is taken for several, a number for a text that may be one, and a table for texts NAME=VALUE.
    """
    plain = str(plain_of(hint))
    if "tuple" in plain and isinstance(value, Mapping):
        each = {name: x if isinstance(x, list | tuple) else [x] for name, x in value.items()}
        value = tuple(f"{name}={','.join(map(str, x))}" for name, x in each.items())
    if plain_of(hint) is bool and not isinstance(value, bool):
        raise ExperimentError(f"{where} = {value!r:.60}: must be true or false")
    if "tuple" in plain and isinstance(value, str | int | float | Path) and not isinstance(value, bool):
        value = (value,)
    if plain_of(hint) in (str, str | None) and isinstance(value, int | float | Path) and not isinstance(value, bool):
        value = str(value)
    several = value if isinstance(value, list | tuple) else (value,)
    if "bool" not in plain and any(isinstance(each, bool) for each in several):
        raise ExperimentError(f"{where} = {value!r:.60}: true and false are no values of it")
    try:
        return TypeAdapter(hint, config=ConfigDict(arbitrary_types_allowed=True)).validate_python(value)
    except ValidationError as error:
        detail = error.errors(include_url=False)[0]
        said = str(detail["msg"]).replace("Input should be", "must be")
        raise ExperimentError(f"{where} = {detail['input']!r:.60}: {said}") from None
