"""An encoder: what the controller sees, and logs, of a joint's position."""

from collections.abc import Sequence

import numpy as np

from idbench.sim.encoders import AbstractEncoder, AbstractReader
from idbench.sim.robot.motors import Array
from idbench.sim.settings import NotNegative, settings


@settings
class Starter(AbstractEncoder):
    """Positions with white noise, as of a resolver."""

    noise: NotNegative = 5e-6
    """rms [rad]."""

    def start(self, n: int, samples: int, fs: float, rngs: Sequence[np.random.Generator]) -> AbstractReader:
        """Return the encoders of `n` joints; a generator for each simulation, so that none depends on the others."""
        return _Reader(self.noise * np.stack([rng.standard_normal((samples, n)) for rng in rngs], axis=1))

    def spread(self, n: int) -> Array:
        """Return the noise of `n` joints [rad]."""
        return np.full(n, self.noise)


class _Reader(AbstractReader):
    def __init__(self, noise: Array) -> None:
        self._noise = noise

    def read(self, k: int, q: Array) -> Array:
        return q + self._noise[k]
