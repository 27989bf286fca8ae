"""Encoders, and their table."""

from identify.plugins import PluginTable
from sim.encoders.base import AbstractEncoder as AbstractEncoder
from sim.encoders.base import AbstractReader as AbstractReader
from sim.encoders.exact import ExactEncoder as ExactEncoder
from sim.encoders.incremental import IncrementalEncoder as IncrementalEncoder

ENCODERS: PluginTable[AbstractEncoder] = PluginTable(
    "encoders",
    AbstractEncoder,  # type: ignore[type-abstract]  # only asked whether an instance is one
    {
        "exact": ExactEncoder,
        "incremental": IncrementalEncoder,
    },
)
