"""What a mask is."""

from abc import ABC, abstractmethod

from idbench.identify.arrays import Array


class AbstractMask(ABC):
    """Weights of the instants: both sides of a model are multiplied by them before the operator."""

    @abstractmethod
    def halo(self, fs: float) -> float:
        """Return how far [s] a weight looks to either side."""

    def suited(self, qd: Array) -> "AbstractMask":
        """Return the mask with settings that follow a motion, velocities of shape (..., joint, time); itself by default."""
        del qd
        return self

    @abstractmethod
    def weight(self, qd: Array, fs: float) -> Array:
        """Return weights between 0 and 1 of every joint's instants, shape (..., joint, time) like `qd` [rad/s]."""
