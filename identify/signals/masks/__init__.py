"""Masks, and their table."""

from identify.plugins import Table
from identify.signals.masks.mask import AbstractMask as AbstractMask
from identify.signals.masks.no_mask import NoMask as NoMask
from identify.signals.masks.reversal import ReversalMask as ReversalMask

MASKS: Table[AbstractMask] = Table(
    "masks",
    AbstractMask,  # type: ignore[type-abstract]  # only asked whether an instance is one
    {
        "none": NoMask,
        "reversal": ReversalMask,
    },
)
