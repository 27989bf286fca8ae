"""What a typical error asks of a setting: an encoder of 14 bits for 0.1 %."""

from collections.abc import Iterator, Sequence
from math import log2

from idbench.experiments.study.axis import FRICTION
from idbench.experiments.study.statistics import Cell

LEVELS = (0.1, 0.01, 0.001, 0.0001)
"""Typical errors that are asked for."""

MAX_NAMED = 2
"""Errors that are named."""

LINES = "encoder.lines"
"""The setting that people know as bits."""


def requirements(cells: Sequence[Cell], edges: int = 4) -> str:
    """Return what some typical errors ask of the only setting that varies, in words; empty if it does not decide the error.

    Parameters
    ----------
    cells : sequence of Cell
        Of one way of identification.
    edges : int
        Edges that are counted in a line of an encoder.
    """
    fields = [field for field in cells[0].settings if field != FRICTION]
    varied = [field for field in fields if len({str(cell.settings[field]) for cell in cells}) > 1]
    if len(varied) != 1 or not all(isinstance(cell.settings[varied[0]], float) for cell in cells):
        return ""
    found = list(_requirements(cells, varied[0], edges))
    return f"a typical error of {', '.join(found[-MAX_NAMED:])}" if found else ""


def _requirements(cells: Sequence[Cell], field: str, edges: int) -> Iterator[str]:
    """Yield what each level asks, the largest error first."""
    falling = sorted(cells, key=lambda cell: cell.settings[field])
    rises = falling[-1].typical > falling[0].typical
    weakest_first = falling[::-1] if rises else falling
    for level in LEVELS:
        enough = [k for k in range(len(weakest_first)) if all(cell.typical <= level for cell in weakest_first[k:])]
        if enough and enough[0] > 0:
            value = weakest_first[enough[0]].settings[field]
            yield f"{100 * level:g} % requires {field} of at {'most' if rises else 'least'} {in_words(field, value, edges)}"


def in_words(field: str, value: object, edges: int = 4) -> str:
    """Return the value of a setting as text, lines of an encoder with their bits."""
    if not isinstance(value, float):
        return str(value)
    bits = f" ({log2(edges * value):.3g} bits)" if field == LINES and value > 0 else ""
    return f"{value:.6g}{bits}"
