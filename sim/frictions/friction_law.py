"""What a friction of a scenario is: how the joints of the simulated robot resist."""

from abc import ABC, abstractmethod
from dataclasses import field
from typing import ClassVar, Protocol, final

import mujoco
import numpy as np

from idbench.sim.part import AbstractCompiledPart
from idbench.sim.robot.motors import Array
from idbench.sim.robot.robot import Robot
from idbench.sim.settings import EachNotNegativeOrNone, per_joint, settings


class AbstractContact(ABC):
    """A friction at work; what it remembers is of shape (nsim, joint)."""

    def driven(self, tau: Array) -> None:
        """Receive the torque of the drives in the step to come [N m], shape (nsim, joint), before `torque` is asked for."""

    @abstractmethod
    def torque(self, qd: Array) -> Array | float:
        """Return the torque on the joints in the step to come [N m], beside what MuJoCo itself applies.

        Parameters
        ----------
        qd : Array, shape (nsim, joint)
            Speed in the middle of the step [rad/s].
        """


class CompiledContact(AbstractCompiledPart, AbstractContact):
    """A friction in C."""

    _tau: Array | float = 0.0

    def driven(self, tau: Array) -> None:
        """Receive the torque of the drives."""
        self._tau = tau

    def torque(self, qd: Array) -> Array:
        """Torque on the joints, as in the loop."""
        return self.call_friction(np.asarray(self._tau), qd)


class PlantJoints(Protocol):
    """The joints of simulations in MuJoCo; arrays of shape (nsim, joint)."""

    stride: int
    """How far apart joints are in MuJoCo's arrays."""

    def bind(self, name: str) -> Array:
        """Return a field of the data, such as qpos, as it is whenever a friction is asked."""

    def expand(self, name: str) -> Array:
        """Return a field of the model, such as dof_frictionloss; what a friction writes into it holds."""

    def addresses(self, name: str) -> list[int]:
        """Where a field of the model or the data begins, in each simulation, for frictions in C."""


@settings
class AbstractFrictionLaw(ABC):
    """The settings of a friction; all have Fv and Fs."""

    steady: ClassVar[bool] = False
    """Whether MuJoCo alone makes the friction, so that many physics steps may be taken at once; not by default."""

    viscous: EachNotNegativeOrNone = field(default=None, kw_only=True)
    """Fv [N m s/rad], of all joints or of each; without it the robot's own."""
    coulomb: EachNotNegativeOrNone = field(default=None, kw_only=True)
    """Fs [N m], of all joints or of each; without it the robot's own."""

    @final
    def edit(self, spec: mujoco.MjSpec) -> None:
        """Write viscous and Coulomb friction into the joints of a robot, and leave its own where none is given."""
        n = len(spec.joints)
        if self.viscous is not None:
            for joint, value in zip(spec.joints, per_joint(self.viscous, n, "friction.viscous"), strict=True):
                joint.damping = [value, *([0.0] * (len(joint.damping) - 1))]
        if self.coulomb is not None:
            for joint, value in zip(spec.joints, per_joint(self.coulomb, n, "friction.coulomb"), strict=True):
                joint.frictionloss = value

    def truth(self, robot: Robot) -> dict[str, float]:
        """True parameters of it beside Fv and Fs, by the names of `identify`, such as vs1."""
        return {}

    def conditions(self, t: Array, n: int) -> dict[str, Array]:
        """Further columns of the log at its instants t [s], shape (time, joint or 1)."""
        return {}

    @abstractmethod
    def start(self, plant: PlantJoints, Fs: Array, h: float) -> AbstractContact:
        """Return the friction of standing joints.

        Parameters
        ----------
        plant : PlantJoints
            The simulations, which have the friction that `edit` wrote.
        Fs : Array, shape (nsim, joint)
            Coulomb friction [N m] of every simulation.
        h : float
            Physics step [s].
        """
