"""Operators that turn a model into rows, and their table."""

from idbench.identify.plugins import Table
from idbench.identify.rows.operators.low_pass import AbstractOperator as AbstractOperator
from idbench.identify.rows.operators.low_pass import FirLowPass as FirLowPass
from idbench.identify.rows.operators.low_pass import IirLowPass as IirLowPass
from idbench.identify.rows.operators.windows import ModulatingFunctions as ModulatingFunctions
from idbench.identify.rows.operators.windows import Samples as Samples
from idbench.identify.rows.operators.windows import Windows as Windows

OPERATORS: Table[AbstractOperator] = Table(
    "operators",
    AbstractOperator,  # type: ignore[type-abstract]  # only asked whether an instance is one
    {"fir": FirLowPass, "iir": IirLowPass, "windows": Windows, "modulating": ModulatingFunctions, "samples": Samples},
)
