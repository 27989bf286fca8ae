"""Prefilters of positions and torques, and their table."""

from idbench.identify.plugins import Table
from idbench.identify.signals.prefilters.butterworth import ButterworthPrefilter as ButterworthPrefilter
from idbench.identify.signals.prefilters.no_prefilter import NoPrefilter as NoPrefilter
from idbench.identify.signals.prefilters.prefilter import AbstractPrefilter as AbstractPrefilter

PREFILTERS: Table[AbstractPrefilter] = Table(
    "prefilters",
    AbstractPrefilter,  # type: ignore[type-abstract]  # only asked whether an instance is one
    {
        "none": NoPrefilter,
        "butterworth": ButterworthPrefilter,
    },
)
