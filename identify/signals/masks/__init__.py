"""Masks, and their table."""

from idbench.identify.plugins import Table
from idbench.identify.signals.masks.mask import AbstractMask as AbstractMask
from idbench.identify.signals.masks.no_mask import NoMask as NoMask
from idbench.identify.signals.masks.reversal import ReversalMask as ReversalMask

MASKS: Table[AbstractMask] = Table(
    "masks",
    AbstractMask,  # type: ignore[type-abstract]  # only asked whether an instance is one
    {
        "none": NoMask,
        "reversal": ReversalMask,
    },
)
