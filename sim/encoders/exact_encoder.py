"""An encoder without error."""

from collections.abc import Sequence
from typing import final

import numpy as np

from idbench.sim.encoders.encoder import AbstractEncoder, AbstractReader
from idbench.sim.robot.motors import Array
from idbench.sim.settings import settings


@final
@settings
class ExactEncoder(AbstractEncoder):
    """Positions as they are."""

    def start(self, n: int, samples: int, fs: float, rngs: Sequence[np.random.Generator]) -> AbstractReader:
        """Return the encoder."""
        del n, samples, fs, rngs
        return _Reader()

    def spread(self, n: int) -> Array:
        """Return zeros."""
        return np.zeros(n)


class _Reader(AbstractReader):
    def read(self, k: int, q: Array) -> Array:
        del k
        return q.copy()
