"""Central differences."""

from dataclasses import dataclass
from typing import Literal, final

import numpy as np

from identify.arrays import Array
from identify.differentiators.base import AbstractDifferentiator
from identify.errors import SettingError
from identify.stencils import slide

_WEIGHTS = {
    2: np.array([-1.0, 0.0, 1.0]) / 2,
    6: np.array([-1.0, 9.0, -45.0, 0.0, 45.0, -9.0, 1.0]) / 60,
}
"""Weights that are exact for polynomials of degree 2 and 6."""


@final
@dataclass(frozen=True)
class CentralDifference(AbstractDifferentiator):
    """Central difference of order 2 (the paper's) or 6.

    Parameters
    ----------
    order : {2, 6}
        Order of accuracy. At the angular frequency w the derivative is too small by (w/fs)^2 / 6 (order 2) or
        (w/fs)^6 / 140 (order 6).
    """

    order: Literal[2, 6] = 6

    def __post_init__(self) -> None:
        if self.order not in _WEIGHTS:
            raise SettingError(f"central difference of order {self.order} is unknown; known orders: 2, 6")

    def halo(self, fs: float) -> float:
        """Return half the number of intervals the difference spans."""
        return self.order / 2 / fs

    def derivative(self, x: Array, fs: float) -> Array:
        """Return the central difference of `x` times `fs`."""
        return slide(x, _WEIGHTS[self.order] * fs)
