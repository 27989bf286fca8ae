"""Encoders, and their table."""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import Literal

import numpy as np

from idbench.identify.plugins import PluginTable
from idbench.sim.errors import ScenarioError
from idbench.sim.robot.motors import Array
from idbench.sim.settings import EachCount, NotNegative, Share, per_joint, settings


class AbstractReader(ABC):
    """An encoder at work; what it remembers is of shape (nsim, joint)."""

    @abstractmethod
    def read(self, k: int, q: Array) -> Array:
        """Return the measured positions [rad] of sample `k`, shape (nsim, joint); asked once a sample."""


class AbstractEncoder(ABC):
    """The settings of an encoder."""

    @abstractmethod
    def start(self, n: int, samples: int, fs: float, rngs: Sequence[np.random.Generator]) -> AbstractReader:
        """Return the encoders of `n` joints.

        Parameters
        ----------
        n, samples : int
            Number of joints, and of samples to come.
        fs : float
            [Hz].
        rngs : sequence of numpy.random.Generator
            One for each simulation, so that none depends on the others.
        """

    def spread(self, n: int) -> Array:
        """Return the standard deviation of the noise in the positions of `n` moving joints, shape (n,) [rad]; asked for bounds.

        Raises
        ------
        ScenarioError
            If it does not say.
        """
        raise ScenarioError(f"encoder {type(self).__name__} has no spread({n}), which a study with bound = true needs")


@settings
class ExactEncoder(AbstractEncoder):
    """Positions as they are."""

    def start(self, n: int, samples: int, fs: float, rngs: Sequence[np.random.Generator]) -> AbstractReader:
        """Return the encoder."""
        return _ExactReader()

    def spread(self, n: int) -> Array:
        """Return zeros."""
        return np.zeros(n)


class _ExactReader(AbstractReader):
    def read(self, k: int, q: Array) -> Array:
        return q.copy()


@settings
class IncrementalEncoder(AbstractEncoder):
    """Incremental encoder: lines, quadrature, interpolation error, noise, missed counts. A count in, an angle out."""

    lines: EachCount = (16384,)
    """Signal periods a turn, of all joints or of each; 16384 lines with quadrature make 16 bits."""
    quadrature: Literal[1, 2, 4] = 4
    """Counts a signal period."""
    offset: Share = 0.5
    """Where in a count the position is zero: 0.5 rounds to the nearest count, 0 rounds down."""
    interpolation_error: NotNegative = 0.0
    """Amplitude of the error inside a signal period, repeating with it [signal periods]."""
    noise: NotNegative = 0.0
    """White noise of the position before it is counted, rms [rad]."""
    missed_counts: NotNegative = 0.0
    """Counts that a moving joint loses for good [1/s]."""

    def start(self, n: int, samples: int, fs: float, rngs: Sequence[np.random.Generator]) -> AbstractReader:
        """Return the encoders, their random events drawn."""
        if self.missed_counts > fs:
            raise ScenarioError(f"encoder.missed_counts = {self.missed_counts:g} 1/s must be at most fs = {fs:g} Hz")
        noise = missed = np.zeros((samples, 1, 1))
        if self.noise or self.missed_counts:
            noise = np.stack([self.noise * rng.standard_normal((samples, n)) for rng in rngs], axis=1)
        if self.missed_counts:
            missed = np.stack([(rng.random((samples, n)) < self.missed_counts / fs).astype(np.float64) for rng in rngs], axis=1)
        return _Reader(self, per_joint(self.lines, n, "encoder.lines"), noise, missed)

    def spread(self, n: int) -> Array:
        """Standard deviation of counts (step / sqrt(12)), noise and interpolation error together."""
        period = 2 * np.pi / per_joint(self.lines, n, "encoder.lines")
        return np.sqrt((period / self.quadrature) ** 2 / 12 + self.noise**2 + (self.interpolation_error * period) ** 2 / 2)


class _Reader(AbstractReader):
    def __init__(self, settings: IncrementalEncoder, lines: Array, noise: Array, missed: Array) -> None:
        self._settings = settings
        self._noise = noise
        self._missed = missed
        self._counts_per_rad = lines * settings.quadrature / (2 * np.pi)
        self._before: Array | None = None
        self._lost = np.zeros(noise.shape[1:])

    def read(self, k: int, q: Array) -> Array:
        counts = self._count(q + self._noise[k] if self._settings.noise else q)
        if not self._settings.missed_counts:
            return counts / self._counts_per_rad
        if self._before is not None:
            self._lost = self._lost + np.sign(counts - self._before) * self._missed[k]
        self._before = counts
        return (counts - self._lost) / self._counts_per_rad

    def _count(self, q: Array) -> Array:
        period, error = self._settings.quadrature, self._settings.interpolation_error
        x = q * self._counts_per_rad
        if error:
            x = x + period * error * np.sin(2 * np.pi / period * x)
        return np.floor(x + self._settings.offset)


ENCODERS: PluginTable[AbstractEncoder] = PluginTable(
    "encoders",
    AbstractEncoder,  # type: ignore[type-abstract]  # only asked whether an instance is one
    {"exact": ExactEncoder, "incremental": IncrementalEncoder},
)
