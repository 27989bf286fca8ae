"""No mask."""

from dataclasses import dataclass
from typing import final

import numpy as np

from idbench.identify.arrays import Array
from idbench.identify.signals.masks.mask import AbstractMask


@final
@dataclass(frozen=True)
class NoMask(AbstractMask):
    """Keeps every instant."""

    def halo(self, fs: float) -> float:
        """Return 0."""
        del fs
        return 0.0

    def weight(self, qd: Array, fs: float) -> Array:
        """Return ones."""
        del fs
        return np.ones_like(qd)
