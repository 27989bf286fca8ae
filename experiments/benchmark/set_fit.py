"""A set that is fitted."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import final

from idbench.experiments.benchmark.definition import Definition
from idbench.experiments.identification.fit import Fit
from idbench.identify import MotionLog


@final
@dataclass(frozen=True, eq=False)
class SetFit:
    """A set that is fitted."""

    definition: Definition
    """What it is."""
    fit: Fit
    """Its fit."""
    repeated: Callable[[], Mapping[str, MotionLog]]
    """Reads the logs that are fitted one by one, by name."""
    seen: Callable[[], Mapping[str, int]]
    """Counts samples that files of the fit have too, by the name of the held-out file, before any were resampled."""
    seconds: float
    """How long reading and fitting took."""
