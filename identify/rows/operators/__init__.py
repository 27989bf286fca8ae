"""Operators that turn a model into rows, and their table."""

from identify.plugins import Table
from identify.rows.operators.fir_low_pass import FirLowPass as FirLowPass
from identify.rows.operators.iir_low_pass import IirLowPass as IirLowPass
from identify.rows.operators.modulating import ModulatingFunctions as ModulatingFunctions
from identify.rows.operators.operator import AbstractOperator as AbstractOperator
from identify.rows.operators.samples import Samples as Samples
from identify.rows.operators.windows import Windows as Windows

OPERATORS: Table[AbstractOperator] = Table(
    "operators",
    AbstractOperator,  # type: ignore[type-abstract]  # only asked whether an instance is one
    {
        "fir": FirLowPass,
        "iir": IirLowPass,
        "windows": Windows,
        "modulating": ModulatingFunctions,
        "samples": Samples,
    },
)
