"""A set that is fitted."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import final

from experiments.benchmark.definition import Definition
from experiments.identification.fit import Fit
from identify import MotionLog


@final
@dataclass(frozen=True, eq=False)
class SetFit:
    """A set that is fitted.

    Parameters
    ----------
    definition : Definition
        What it is.
    fit : Fit
        Its fit.
    repeated : callable
        Reads the logs that are fitted one by one, by name.
    seconds : float
        How long reading and fitting took.
    """

    definition: Definition
    fit: Fit
    repeated: Callable[[], Mapping[str, MotionLog]]
    seconds: float
