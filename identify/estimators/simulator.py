"""What estimators that simulate are given: the robot with any parameters, in the loop of a log and by itself."""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from idbench.identify.arrays import Array
from idbench.identify.data.motion_log import MotionLog


@dataclass(frozen=True, eq=False)
class Simulated:
    """The logs of simulated robots."""

    logs: tuple[MotionLog, ...]
    """One for each log of the problem; leading axes are those of the parameters."""
    failures: Mapping[tuple[int, ...], str] = field(default_factory=dict)
    """Why simulations failed, by their place in the leading axes; their logs hold nothing of use."""


class AbstractLoop(ABC):
    """The closed loops in which the logs of a problem were recorded, without noise."""

    @abstractmethod
    def repeat(self, X: Array, *, informed: bool = False, exact: bool = True) -> Simulated:
        """Return the logs that robots with these parameters give on the motions of the problem's logs.

        Parameters
        ----------
        X : Array, shape (..., p), or (..., run, p) for a problem of many runs
            A robot for each row.
        informed : bool
            Whether the controller's own model of the robot is X, too: gains and feedforward are then those that such a robot
            would have been given, so that it follows the motion, however wrong X is (the update of gains of M. Gautier,
            A. Janot and P.-O. Vandanjon, "A new closed-loop output error method for parameter identification of robot
            dynamics", IEEE Trans. Control Systems Technology 21 (2013) 428-444).
        exact : bool
            Whether parameters that the simulated robot does not have, such as those of some laws of friction, are an error.
            Otherwise they are left out: the motion is nearly that of the log all the same.

        Raises
        ------
        IdentificationError
            If the loop cannot be simulated, or such a parameter is an error.
        """


class AbstractPlant(ABC):
    """The robot of a problem by itself, driven by the torques of a log."""

    @abstractmethod
    def shoot(self, X: Array, q: Array, qd: Array, log: MotionLog, first: npt.NDArray[np.intp], count: int) -> Array:
        """Return positions [rad] of robots that start somewhere in a log, shape (sim, count, joint), NaN of those that fail.

        Parameters
        ----------
        X : Array, shape (sim, p)
            Their parameters.
        q, qd : Array, shape (sim, joint)
            Their states at the first sample [rad, rad/s].
        log : MotionLog
            A single run; its torques act as its channel says.
        first : int array, shape (sim,)
            Sample of the log at which each starts; a sample before it is there.
        count : int
            Number of samples, the first included.
        """


@dataclass(frozen=True, eq=False)
class Simulation:
    """How the robot of a problem is simulated."""

    loop: AbstractLoop | None = None
    """The closed loops in which the logs were recorded (IV, DIDIM, CLIE, CLOE)."""
    plant: AbstractPlant | None = None
    """The robot by itself, driven by the torques of a log (OE)."""
    start: Array | None = None
    """Where estimators begin that simulate or filter; by default at the weighted least-squares estimate, shape (..., p),
    optional."""
