"""Encoders, and their table."""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import Literal

import numpy as np

from idbench.identify.plugins import PluginTable
from idbench.sim.errors import ScenarioError
from idbench.sim.part import AbstractCompiledPart
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
        return CompiledReader("exact_encoder", (len(rngs), n), ())

    def spread(self, n: int) -> Array:
        """Return zeros."""
        return np.zeros(n)


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
        noise = missed = None
        if self.noise or self.missed_counts:
            noise = np.stack([self.noise * rng.standard_normal((samples, n)) for rng in rngs])
        if self.missed_counts:
            missed = np.stack([(rng.random((samples, n)) < self.missed_counts / fs).astype(np.float64) for rng in rngs])
        counts = per_joint(self.lines, n, "encoder.lines") * self.quadrature / (2 * np.pi)
        rows = counts, self.offset, self.quadrature, self.interpolation_error, 0.0, 0.0
        return CompiledReader("incremental_encoder", (len(rngs), n), rows, signals=(noise if self.noise else None, missed))

    def spread(self, n: int) -> Array:
        """Standard deviation of counts (step / sqrt(12)), noise and interpolation error together."""
        period = 2 * np.pi / per_joint(self.lines, n, "encoder.lines")
        return np.sqrt((period / self.quadrature) ** 2 / 12 + self.noise**2 + (self.interpolation_error * period) ** 2 / 2)


class CompiledReader(AbstractCompiledPart, AbstractReader):
    """An encoder in C."""

    def read(self, k: int, q: Array) -> Array:
        """Measured positions [rad], as in the loop."""
        return self.call_sampled(k, q)


ENCODERS: PluginTable[AbstractEncoder] = PluginTable(
    "encoders",
    AbstractEncoder,  # type: ignore[type-abstract]  # only asked whether an instance is one
    {"exact": ExactEncoder, "incremental": IncrementalEncoder},
)
