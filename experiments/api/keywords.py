"""Options of commands as keywords."""

import inspect
import json
import re
from collections.abc import Callable, Container
from functools import reduce
from typing import Any, TypeVar

from idbench.experiments.requests.jobs import IdentifyRequest
from idbench.experiments.requests.words import plain_of, request_keys

Call = TypeVar("Call", bound=Callable[..., Any])


def with_keys(request: Any, taken: Container[str] = ()) -> Callable[[Call], Call]:
    """Decorator that puts the keys of a request into the signature of a function, which help and tab completion read."""

    def signed(call: Call) -> Call:
        own, keyword, nothing = inspect.signature(call), inspect.Parameter.KEYWORD_ONLY, inspect.Parameter.empty
        every = {name: p for name, p in own.parameters.items() if p.kind is not p.VAR_KEYWORD}
        for key, (place, hint) in request_keys(request).items():
            if key not in taken and key not in every:
                default = reduce(lambda of, name: getattr(of, name, nothing), place, request)
                every[key] = inspect.Parameter(key, keyword, default=default, annotation=plain_of(hint))
        call.__signature__ = own.replace(parameters=[*every.values()])  # type: ignore[attr-defined]
        return call

    return signed


WORDS = "estimate|joints|auto|smooth|standard|none|all|held|instantaneous|averaged"  # Values that are words of sentences, too
OPTION = re.compile(rf"--([a-z][a-z-]*)((?: (?:(?:{WORDS})\b|[^\s;,()]*(?:[\d=A-Z]|\.[a-z]))[^\s;,()]*)*)")
BETWEEN = re.compile(r"(?<=[\]\"\d]) (?=[a-z_]+=)")  # One keyword and the next
NUMBER = re.compile(r"-?[\d.]+(e[-+]?\d+)?")


def in_python(text: str) -> str:
    """Return a text with keywords of `idbench.fit` in the place of the options of `idbench identify`."""
    keys = request_keys(IdentifyRequest)

    def keyword(found: re.Match[str]) -> str:
        key, values = (
            found[1].replace("-", "_"),
            [word if NUMBER.fullmatch(word) else json.dumps(word) for word in found[2].split()],
        )
        if key == "write":
            return f"fit.write({', '.join(values)})"
        if key not in keys:
            return found[0]
        if plain_of(keys[key][1]) is bool:
            return f"{key}=True{found[2]}"
        return f"{key}={values[0] if len(values) == 1 else '[' + ', '.join(values) + ']'}"

    return BETWEEN.sub(", ", OPTION.sub(keyword, text.replace("idbench excite", "idbench.design")))
