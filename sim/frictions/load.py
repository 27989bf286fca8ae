"""Friction that grows with the load."""

from typing import final

import numpy as np
from mujoco.batch import Batch

from idbench.sim.frictions.friction_law import AbstractContact, AbstractFrictionLaw
from idbench.sim.robot.motors import Array
from idbench.sim.robot.robot import Robot
from idbench.sim.settings import EachNotNegative, EachNotNegativeOrNone, per_joint, settings


@final
@settings
class LoadDependent(AbstractFrictionLaw):
    """(Fs + share |load|) sign(qd) + Fv qd, the load being all torque but friction, of gravity and inertia of links and rotors.

    The friction in it is that of the physics step before.
    """

    share: EachNotNegative = (0.1,)
    """Friction over load, of all joints or of each."""
    viscous: EachNotNegativeOrNone = None
    """Fv [N m s/rad], of all joints or of each; without it the robot's own."""
    coulomb: EachNotNegativeOrNone = None
    """Fs [N m], of all joints or of each; without it the robot's own."""

    @property
    def steady(self) -> bool:
        """False."""
        return False

    def truth(self, robot: Robot) -> dict[str, float]:
        """Return Fl."""
        return {f"Fl{j + 1}": float(x) for j, x in enumerate(per_joint(self.share, robot.n, "friction.share"))}

    def start(self, plant: Batch, Fs: Array, h: float) -> AbstractContact:
        """Return the law, which sets MuJoCo's Coulomb friction anew in every step: its constraint keeps standing joints."""
        del h
        return _Contact(plant, Fs, per_joint(self.share, Fs.shape[-1], "friction.share"))


class _Contact(AbstractContact):
    def __init__(self, plant: Batch, Fs: Array, share: Array) -> None:
        self._frictionloss, self._Fs, self._share = plant.expand("dof_frictionloss"), Fs.copy(), share
        self._frictions = [plant.bind(f"qfrc_{name}") for name in ("passive", "constraint")]
        self._tau = np.zeros(Fs.shape)

    def driven(self, tau: Array) -> None:
        """Receive what the joints carry, friction included."""
        self._tau = tau

    def torque(self, qd: Array) -> Array | float:
        del qd
        self._frictionloss[:] = self._Fs + self._share * np.abs(np.sum([self._tau, *self._frictions], axis=0))
        return 0.0
