"""What an encoder is: what stands between a joint's position and the position that the controller sees and logs."""

from abc import ABC, abstractmethod
from collections.abc import Sequence

import numpy as np

from idbench.sim.errors import ScenarioError
from idbench.sim.robot.motors import Array


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
