"""Masks, and their table."""

from identify.masks.base import AbstractMask as AbstractMask
from identify.masks.none import NoMask as NoMask
from identify.masks.reversal import ReversalMask as ReversalMask
from identify.plugins import PluginTable

MASKS: PluginTable[AbstractMask] = PluginTable(
    "masks",
    AbstractMask,  # type: ignore[type-abstract]  # only asked whether an instance is one
    {
        "none": NoMask,
        "reversal": ReversalMask,
    },
)
