"""The contract of every plug-in point."""

import importlib
from collections.abc import Iterator, Mapping
from typing import Any

from idbench.experiments.contracts import identification_contracts as identification
from idbench.experiments.contracts import simulation_contracts as simulation
from idbench.experiments.contracts.contract import Clause, ContractError, Example
from idbench.experiments.errors import ExperimentError
from idbench.experiments.plugin_tables import TABLES
from idbench.identify.blame import is_mistake
from idbench.identify.plugins import Table, did_you_mean

CONTRACTS: Mapping[str, tuple[Clause, ...]] = {
    "blocks": (identification.block_names_its_parameters, identification.block_keeps_its_identities),
    "models": (identification.model_says_a_true_sentence,),
    "prefilters": (identification.prefilter_keeps_constants, identification.prefilter_has_no_phase),
    "differentiators": (identification.differentiator_knows_a_line,),
    "alignments": (identification.alignment_keeps_constants,),
    "masks": (identification.mask_gives_weights,),
    "operators": (identification.operator_agrees_with_its_step,),
    "chains": (identification.chain_recovers_ideal_data,),
    "estimators": (identification.estimator_recovers_the_truth, identification.estimator_takes_every_run_by_itself),
    "trajectories": (simulation.trajectory_rests_at_both_ends,),
    "controllers": (simulation.controller_commands_every_simulation_by_itself,),
    "drives": (simulation.drive_gives_finite_torques,),
    "frictions": (simulation.friction_resists,),
    "encoders": (simulation.encoder_reads_to_a_count,),
    "excitations": (simulation.excitation_leads_back_to_rest, simulation.excitation_becomes_its_trajectory),
}
"""Plug-in point -> what its plug-ins are asked, after what every plug-in is."""


def found(name: str) -> tuple[Table[Any], Any]:
    """Return the table and the plug-in of a name, such as TLS, drives/averaged or mybench:TotalLeastSquares.

    ExperimentError if there is none, several have the name, or it cannot be loaded.
    """
    if ":" in name:
        return _loaded(name)
    point, _, short = name.rpartition("/")
    there = [table for table in TABLES if short in table and point in ("", table.point)]
    if not there:
        hint = did_you_mean(short, [other for table in TABLES for other in table])
        raise ExperimentError(f"no plug-in {name!r}{hint}: idbench list has them all, or name MODULE:CLASS")
    if len(there) > 1:
        raise ExperimentError(f"{name!r} is several plug-ins: {', '.join(f'{table.point}/{short}' for table in there)}")
    return there[0], there[0].create(short)


def _loaded(name: str) -> tuple[Table[Any], Any]:
    module, _, attribute = name.partition(":")
    try:
        made = getattr(importlib.import_module(module), attribute)()
    except BaseException as error:  # whatever another package raises
        if not is_mistake(error):
            raise
        raise ExperimentError(f"{name} cannot be made without arguments: {type(error).__name__}: {error}") from error
    there = [table for table in TABLES if isinstance(made, table.kind)]
    if not there:
        raise ExperimentError(f"{name} makes {type(made).__name__}, which is a plug-in of no point")
    return there[0], made


def kept(name: str, example: Example) -> Iterator[tuple[str, str]]:
    """Yield what the plug-in of a name is asked, and why it does not keep it; the tests of plug-in packages ask this."""
    yield from keeps(*found(name), example)


def keeps(table: Table[Any], plugin: Any, example: Example) -> Iterator[tuple[str, str]]:
    """Yield what a plug-in of a table is asked, and why it does not keep it; empty if it does."""
    for clause in (identification.is_immutable, *CONTRACTS[table.point]):
        asked = (clause.__doc__ or "").splitlines()[0]
        try:
            clause(plugin, example)
        except BaseException as error:  # whatever a plug-in raises
            if not is_mistake(error):
                raise
            yield asked, f"{type(error).__name__}: {error}" if not isinstance(error, ContractError) else str(error)
        else:
            yield asked, ""
