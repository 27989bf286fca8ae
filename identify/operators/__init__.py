"""Operators that turn a model into rows, and their table."""

from identify.operators.base import AbstractOperator as AbstractOperator
from identify.operators.fir_low_pass import FirLowPass as FirLowPass
from identify.operators.iir_low_pass import IirLowPass as IirLowPass
from identify.operators.modulating import ModulatingFunctions as ModulatingFunctions
from identify.operators.windows import Windows as Windows
from identify.plugins import PluginTable

OPERATORS: PluginTable[AbstractOperator] = PluginTable(
    "operators",
    AbstractOperator,  # type: ignore[type-abstract]  # only asked whether an instance is one
    {
        "fir": FirLowPass,
        "iir": IirLowPass,
        "windows": Windows,
        "modulating": ModulatingFunctions,
    },
)
