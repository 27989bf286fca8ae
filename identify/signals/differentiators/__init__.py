"""Differentiators, and their table."""

from idbench.identify.plugins import Table
from idbench.identify.signals.differentiators.central import CentralDifference as CentralDifference
from idbench.identify.signals.differentiators.differentiator import (
    AbstractDifferentiator as AbstractDifferentiator,
)

DIFFERENTIATORS: Table[AbstractDifferentiator] = Table(
    "differentiators",
    AbstractDifferentiator,  # type: ignore[type-abstract]  # only asked whether an instance is one
    {
        "central": CentralDifference,
    },
)
