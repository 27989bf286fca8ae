"""Chains with settings other than those that ship: by options, by a file, and along the axes of a study."""

import tomllib
from collections.abc import Iterator, Mapping
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

from idbench.experiments.errors import ExperimentError
from idbench.identify import ALIGNMENTS, CHAINS, DIFFERENTIATORS, MASKS, OPERATORS, PREFILTERS, Chain
from idbench.identify.plugins import Table, did_you_mean
from idbench.identify.signals.prefilters import ButterworthPrefilter

STAGES: dict[str, Table[Any]] = {
    "prefilter": PREFILTERS,
    "differentiator": DIFFERENTIATORS,
    "alignment": ALIGNMENTS,
    "mask": MASKS,
    "operator": OPERATORS,
}
"""The stages of a chain that are plug-ins."""

LOWEST = 0.01  # Band [Hz] below which no joint moves
KIND = "kind"  # Key of a stage's table that names its plug-in


def replaced(part: Any, path: list[str], value: Any) -> Any:
    """Return a frozen dataclass with the value of a field, or of a field of a field, replaced.

    Raises
    ------
    ExperimentError
        If there is no such field, or it does not take the value.
    """
    known = [f.name for f in fields(part)]
    if not path or path[0] not in known:
        hint = did_you_mean(path[0] if path else "", known)
        raise ExperimentError(f"{type(part).__name__} has no such setting{hint}; known: {', '.join(known) or 'none'}")
    if len(path) > 1:
        value = replaced(getattr(part, path[0]), path[1:], value)
    elif path[0] in STAGES and isinstance(part, Chain):
        value = _stage(path[0], value)
    try:
        return replace(part, **{path[0]: value})
    except (TypeError, ValueError) as error:  # such as a SettingError
        raise ExperimentError(str(error)) from error


def _stage(stage: str, value: Any) -> Any:
    """Return a stage by its name, or by a table with its name as `kind` and its settings; raise ExperimentError."""
    table, named = STAGES[stage], value if isinstance(value, dict) else {KIND: value}
    if not isinstance(named.get(KIND), str):
        raise ExperimentError(f"{value!r:.60}: give names, among {', '.join(table)}, or tables such as {{kind = NAME, ...}}")
    part = table.create(named[KIND])
    for key, setting in named.items():
        if key != KIND:
            part = replaced(part, [key], setting)
    return part


def chain_of(file: Path) -> tuple[str, Chain]:
    """Return the chain of a file, and the name of that from which it starts.

    The file has a line such as chain = "idbench", and settings as tables: [operator] with cutoff = 20.0; a key `kind` names
    another plug-in of a stage.

    Raises
    ------
    ExperimentError
        If it cannot be read, or names what there is not.
    """
    try:
        stated = tomllib.loads(file.read_text(encoding="utf-8"))
        name = str(stated.pop("chain", "idbench"))
        chain = CHAINS.create(name)
        for path, value in _settings(stated):
            try:
                chain = replaced(chain, path, value)
            except ExperimentError as error:
                raise ExperimentError(f"{'.'.join(path)} = {value!r:.60}: {error}") from error
    except OSError as error:
        raise ExperimentError(f"--chain-file {file}: {error.strerror or error}") from error
    except (ValueError, RecursionError, ExperimentError) as error:
        raise ExperimentError(f"--chain-file {file}: {error}") from error
    return name, chain


def with_cutoff(chain: Chain, cutoff: float) -> Chain:
    """Return a chain with the band up to `cutoff` [Hz], transition, prefilter and mask in the same relation to it as before.

    A mask's edges must be soft for the band: a wider band lets them be steeper, and short logs lose less to them.

    Raises
    ------
    ExperimentError
        If its operator has no cut-off.
    """
    if not hasattr(chain.operator, "cutoff"):
        raise ExperimentError(f"--cutoff {cutoff:g}: the operator of this chain, {type(chain.operator).__name__}, has none")
    if not LOWEST <= cutoff < float("inf"):
        raise ExperimentError(f"--cutoff {cutoff:g} must be at least {LOWEST:g} [Hz], and finite")
    ratio = cutoff / chain.operator.cutoff
    for stage, setting, scale in (
        ("operator", "transition", ratio),
        ("prefilter", "cutoff", ratio),
        ("mask", "width", 1 / ratio),
        ("mask", "taper", 1 / ratio),
    ):
        part = getattr(chain, stage)
        if hasattr(part, setting) and not isinstance(part, ButterworthPrefilter):  # which has a rule of its own (section 6.2)
            chain = replaced(chain, [stage, setting], getattr(part, setting) * scale)
    found: Chain = replaced(chain, ["operator", "cutoff"], cutoff)
    return found


def _settings(stated: Mapping[str, Any]) -> Iterator[tuple[list[str], Any]]:
    """Yield the settings of a file, a stage's plug-in before its own."""
    for stage, value in stated.items():
        if not isinstance(value, dict):
            yield [stage], value
            continue
        if KIND in value:
            yield [stage], value[KIND]
        yield from (([stage, key], each) for key, each in value.items() if key != KIND)
