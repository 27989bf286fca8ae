"""Prefilters of positions and torques, and their table."""

from identify.plugins import PluginTable
from identify.prefilters.base import AbstractPrefilter as AbstractPrefilter
from identify.prefilters.butterworth import ButterworthPrefilter as ButterworthPrefilter
from identify.prefilters.none import NoPrefilter as NoPrefilter

PREFILTERS: PluginTable[AbstractPrefilter] = PluginTable(
    "prefilters",
    AbstractPrefilter,  # type: ignore[type-abstract]  # only asked whether an instance is one
    {
        "none": NoPrefilter,
        "butterworth": ButterworthPrefilter,
    },
)
