"""Parts of one's own: a word of the command line may name code, as MODULE:NAME; no file may."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, TypeVar

from idbench.experiments.requests.jobs import IdentifyRequest, RunRequest
from idbench.experiments.requests.shared import Parameters

Asked = TypeVar("Asked", bound=IdentifyRequest | RunRequest)


def with_own_parts(asked: Asked) -> Asked:
    """Return a request whose model, chain, estimator and laws are names of the tables, which have loaded those of one's own."""
    from idbench.identify import CHAINS, ESTIMATORS, MODELS

    names: dict[str, Any] = {"chain": CHAINS.load(asked.chain), "estimator": ESTIMATORS.load(asked.estimator)}
    if isinstance(asked, IdentifyRequest) and asked.model:
        names["model"] = MODELS.load(asked.model)
    return replace(asked, parameters=with_own_laws(asked.parameters), **names)


def with_own_laws(asked: Parameters) -> Parameters:
    """Return parameters whose laws of friction are names of the table."""
    return replace(asked, friction=_loaded(asked.friction), add=_loaded(asked.add))


def _loaded(texts: Sequence[str]) -> tuple[str, ...]:
    return tuple("=".join("+".join(map(_law, part.split("+"))) for part in text.split("=")) for text in texts)


def _law(name: str) -> str:
    """Return the name of a law; what a colon follows is a module unless it is a law with the number of its setting."""
    from idbench.identify import BLOCKS

    module, _, law = name.partition(":")
    return BLOCKS.load(name) if law.isidentifier() and module not in BLOCKS else name
