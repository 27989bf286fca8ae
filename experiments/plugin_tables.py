"""Every plug-in point: what can be combined."""

from typing import Any

from experiments.excite.excitation import EXCITATIONS
from identify import (
    ALIGNMENTS,
    BLOCKS,
    CHAINS,
    DIFFERENTIATORS,
    ESTIMATORS,
    MASKS,
    MODELS,
    OPERATORS,
    PREFILTERS,
)
from identify.plugins import PluginTable
from sim.scenario.scenario_file import KINDS

TABLES: tuple[PluginTable[Any], ...] = (
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
"""Every plug-in point."""


def plugin_conflicts() -> list[str]:
    """Return which plug-ins of other packages cannot be used, since their names are taken."""
    return [f"{table.point} plug-in {conflict}" for table in TABLES for conflict in table.conflicts]
