"""What a chain knows of a log before a model looks at it."""

from collections.abc import Callable
from dataclasses import dataclass

from identify.arrays import Array
from identify.state import State
from identify.torques import AbstractTorque


@dataclass(frozen=True, eq=False)
class Signals:
    """The motion, the torque on its time, and the weights of the instants: the same for all models.

    Parameters
    ----------
    state : State
        Prefiltered positions and their derivatives.
    torque : AbstractTorque
        The torque, aligned.
    weight : Array, shape (..., joint, time)
        Weights of the mask.
    fs : float
        [Hz].
    reach : int
        How many samples those two look to either side.
    transposed : callable
        What prefilter and alignment do to torques, turned around in time: (..., time) -> (..., time).
    """

    state: State
    torque: AbstractTorque
    weight: Array
    fs: float
    reach: int
    transposed: Callable[[Array], Array]
