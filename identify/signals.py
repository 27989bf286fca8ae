"""What a chain knows of a log before a model looks at it."""

from dataclasses import dataclass
from functools import cached_property

from identify.arrays import Array
from identify.differentiators import AbstractDifferentiator
from identify.torques import AbstractTorque


@dataclass(frozen=True, eq=False)
class Signals:
    """Prefiltered positions, their derivatives, the torque on their time, and weights, with time as the last axis.

    Parameters
    ----------
    q, qd : Array, shape (..., joint, time)
        [rad], [rad/s].
    torque : AbstractTorque
        The torque, aligned.
    weight : Array, shape (..., joint, time)
        Weights of the mask.
    differentiator : AbstractDifferentiator
        The operator s of this chain.
    fs : float
        [Hz].
    """

    q: Array
    qd: Array
    torque: AbstractTorque
    weight: Array
    differentiator: AbstractDifferentiator
    fs: float

    @cached_property
    def qdd(self) -> Array:
        """Joint accelerations [rad/s^2], shape (..., joint, time); only the explicit model asks for them."""
        return self.s(self.qd)

    def s(self, x: Array) -> Array:
        """Return dx/dt of `x`, shape (..., time)."""
        return self.differentiator.derivative(x, self.fs)
