"""What a controller is: a law that turns sampled positions into commanded torques, for many simulations at once."""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np
import numpy.typing as npt

from idbench.sim.drives.drive import Commanded
from idbench.sim.robot.inverse_dynamics import InverseDynamics, inverse_dynamics
from idbench.sim.robot.motors import Array
from idbench.sim.robot.robot import Robot
from idbench.sim.trajectories import Reference


@dataclass(frozen=True, eq=False)
class Task:
    """What a controller knows when it starts."""

    nominal: Robot
    """The robot as its maker describes it: without payload, with the friction of its MJCF."""
    reference: Reference
    """The planned motion at the sample rate, of all simulations or of each."""
    nsim: int
    """Number of simulations."""
    vary: Mapping[str, npt.ArrayLike] = field(default_factory=dict)
    """Fields of MuJoCo's model of a nominal robot that is another one in each simulation, shape (nsim, ...)."""

    @property
    def model(self) -> InverseDynamics:
        """The nominal robot of every simulation."""
        return InverseDynamics(self.nominal, self.nsim, self.vary)

    @property
    def inertia(self) -> Array:
        """Inertia that each joint's motor sees when the motion starts [kg m^2], shape (1 or nsim, joint)."""
        at = np.atleast_2d(self.reference.q[0])
        model = self.model if self.vary else InverseDynamics(self.nominal, len(at))
        still = np.zeros((self.nsim, self.nominal.n)) if self.vary else np.zeros_like(at)
        model(at + still, still, still)
        return model.inertia().copy()

    @property
    def feedforward(self) -> Array:
        """Torque of the nominal robot along the planned motion, without Coulomb friction [N m].

        Of the shape of the motion, or (time, nsim, joint) if the nominal robot differs.
        """
        planned = self.reference
        if self.vary:
            model, shape = self.model, (len(planned.q), self.nsim, self.nominal.n)
            every = (np.broadcast_to(x if x.ndim == 3 else x[:, None], shape) for x in (planned.q, planned.qd, planned.qdd))
            return np.stack([model(*state) for state in zip(*every, strict=True)])
        q, qd, qdd = (x.reshape(-1, self.nominal.n) for x in (planned.q, planned.qd, planned.qdd))
        return inverse_dynamics(self.nominal, q, qd, qdd).reshape(planned.q.shape)


class AbstractLaw(ABC):
    """A controller at work; what it remembers between samples is of shape (nsim, joint)."""

    @abstractmethod
    def command(self, k: int, q: Array) -> Array:
        """Return the command, shape (nsim, joint), for the positions `q` [rad] of sample `k`; asked once a sample.

        Torques [N m], or positions [rad] of a controller that commands positions.
        """


class AbstractController(ABC):
    """The settings of a control law."""

    commanded: ClassVar[Commanded] = "torque"
    """What it commands."""

    @abstractmethod
    def start(self, task: Task) -> AbstractLaw:
        """Return the law at the start of a motion."""


class Error:
    """Control error e = q_ref - q and its low-passed difference quotient.

    Parameters
    ----------
    reference : Reference
        The planned motion.
    nsim : int
        Number of simulations.
    cutoff : float
        Of the first-order low-pass on the difference quotient [Hz].
    """

    def __init__(self, reference: Reference, nsim: int, cutoff: float) -> None:
        self._reference = reference
        self._share = 1 - np.exp(-2 * np.pi * cutoff / reference.fs)
        self._before: Array | None = None
        self._rate = np.zeros((nsim, reference.q.shape[-1]))

    def update(self, k: int, q: Array) -> tuple[Array, Array]:
        """Return e [rad] and its rate [rad/s] at sample `k`."""
        e = self._reference.q[k] - q
        if self._before is not None:
            self._rate = self._rate + self._share * ((e - self._before) * self._reference.fs - self._rate)
        self._before = e
        return e, self._rate
