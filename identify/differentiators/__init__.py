"""Differentiators, and their table."""

from identify.differentiators.base import (
    AbstractDifferentiator as AbstractDifferentiator,
)
from identify.differentiators.central import CentralDifference as CentralDifference
from identify.plugins import PluginTable

DIFFERENTIATORS: PluginTable[AbstractDifferentiator] = PluginTable(
    "differentiators",
    AbstractDifferentiator,  # type: ignore[type-abstract]  # only asked whether an instance is one
    {
        "central": CentralDifference,
    },
)
