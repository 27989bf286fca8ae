"""Encoders, and their table."""

from idbench.identify.plugins import PluginTable
from idbench.sim.encoders.encoder import AbstractEncoder as AbstractEncoder
from idbench.sim.encoders.encoder import AbstractReader as AbstractReader
from idbench.sim.encoders.exact_encoder import ExactEncoder as ExactEncoder
from idbench.sim.encoders.incremental_encoder import IncrementalEncoder as IncrementalEncoder

ENCODERS: PluginTable[AbstractEncoder] = PluginTable(
    "encoders",
    AbstractEncoder,  # type: ignore[type-abstract]  # only asked whether an instance is one
    {
        "exact": ExactEncoder,
        "incremental": IncrementalEncoder,
    },
)
