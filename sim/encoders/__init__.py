"""Encoders, and their table."""

from identify.plugins import PluginTable
from sim.encoders.encoder import AbstractEncoder as AbstractEncoder
from sim.encoders.encoder import AbstractReader as AbstractReader
from sim.encoders.exact_encoder import ExactEncoder as ExactEncoder
from sim.encoders.incremental_encoder import IncrementalEncoder as IncrementalEncoder

ENCODERS: PluginTable[AbstractEncoder] = PluginTable(
    "encoders",
    AbstractEncoder,  # type: ignore[type-abstract]  # only asked whether an instance is one
    {
        "exact": ExactEncoder,
        "incremental": IncrementalEncoder,
    },
)
