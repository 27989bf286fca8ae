"""Every point where parts can be exchanged: what can be combined."""

from typing import Any

from idbench.experiments.excite.excitation import EXCITATIONS
from idbench.identify import ALIGNMENTS, BLOCKS, CHAINS, DIFFERENTIATORS, ESTIMATORS, MASKS, MODELS, OPERATORS, PREFILTERS
from idbench.identify.plugins import PluginTable, Table
from idbench.sim.scenario.scenario_file import KINDS

TABLES: tuple[Table[Any], ...] = (
    BLOCKS,
    MODELS,
    PREFILTERS,
    DIFFERENTIATORS,
    ALIGNMENTS,
    MASKS,
    OPERATORS,
    CHAINS,
    ESTIMATORS,
    *KINDS.values(),
    EXCITATIONS,
)
"""All of them; to a `PluginTable` other packages add."""


def plugin_conflicts() -> list[str]:
    """Plug-ins of other packages that cannot be used, since their names are taken."""
    tables = [table for table in TABLES if isinstance(table, PluginTable)]
    return [f"{table.point} plug-in {conflict}" for table in tables for conflict in table.conflicts]
