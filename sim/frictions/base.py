"""What a friction of a scenario is: how the joints of the simulated robot resist."""

from abc import ABC, abstractmethod

import mujoco
from mujoco.batch import Batch

from sim.motors import Array
from sim.settings import EachNotNegativeOrNone, per_joint


class AbstractContact(ABC):
    """A friction at work; what it remembers is of shape (nsim, joint)."""

    @abstractmethod
    def torque(self, qd: Array) -> Array | float:
        """Return the torque on the joints in the step to come [N m], beside what MuJoCo itself applies.

        Parameters
        ----------
        qd : Array, shape (nsim, joint)
            Speed in the middle of the step [rad/s].
        """


class AbstractFrictionLaw(ABC):
    """The settings of a friction."""

    @property
    @abstractmethod
    def steady(self) -> bool:
        """Whether MuJoCo alone makes the friction, so that many physics steps may be taken at once."""

    @abstractmethod
    def edit(self, spec: mujoco.MjSpec) -> None:
        """Write viscous and Coulomb friction into the robot before it is compiled."""

    @abstractmethod
    def start(self, plant: Batch, Fs: Array, h: float) -> AbstractContact:
        """Return the friction of standing joints.

        Parameters
        ----------
        plant : mujoco.batch.Batch
            The simulations, which have the friction that `edit` wrote.
        Fs : Array, shape (nsim, joint)
            Coulomb friction [N m] of every simulation.
        h : float
            Physics step [s].
        """


def write(spec: mujoco.MjSpec, viscous: EachNotNegativeOrNone, coulomb: EachNotNegativeOrNone) -> None:
    """Write the friction that is given into the joints of a robot, and leave its own where none is."""
    for field, name, values in (("damping", "viscous", viscous), ("frictionloss", "coulomb", coulomb)):
        if values is not None:
            for joint, value in zip(spec.joints, per_joint(values, len(spec.joints), f"friction.{name}"), strict=True):
                if field == "damping":
                    joint.damping = [value, *([0.0] * (len(joint.damping) - 1))]
                else:
                    joint.frictionloss = value
