"""Prefilters of positions and torques, and their table."""

from identify.plugins import Table
from identify.signals.prefilters.butterworth import ButterworthPrefilter as ButterworthPrefilter
from identify.signals.prefilters.no_prefilter import NoPrefilter as NoPrefilter
from identify.signals.prefilters.prefilter import AbstractPrefilter as AbstractPrefilter

PREFILTERS: Table[AbstractPrefilter] = Table(
    "prefilters",
    AbstractPrefilter,  # type: ignore[type-abstract]  # only asked whether an instance is one
    {
        "none": NoPrefilter,
        "butterworth": ButterworthPrefilter,
    },
)
