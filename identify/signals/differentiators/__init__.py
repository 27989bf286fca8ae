"""Differentiators, and their table."""

from identify.plugins import Table
from identify.signals.differentiators.central import CentralDifference as CentralDifference
from identify.signals.differentiators.differentiator import (
    AbstractDifferentiator as AbstractDifferentiator,
)

DIFFERENTIATORS: Table[AbstractDifferentiator] = Table(
    "differentiators",
    AbstractDifferentiator,  # type: ignore[type-abstract]  # only asked whether an instance is one
    {
        "central": CentralDifference,
    },
)
