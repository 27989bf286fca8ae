"""Friction that differs with the direction."""

from typing import final

import numpy as np
from mujoco.batch import Batch

from idbench.sim.frictions.friction_law import AbstractContact, AbstractFrictionLaw
from idbench.sim.robot.motors import Array
from idbench.sim.robot.robot import Robot
from idbench.sim.settings import EachNotNegativeOrNone, EachNumber, Positive, per_joint, settings


@final
@settings
class Asymmetric(AbstractFrictionLaw):
    """Forwards Fs + offset and Fv + difference, backwards Fs - offset and Fv - difference."""

    offset: EachNumber = (0.0,)
    """Half of what Coulomb friction forwards has above that backwards [N m], of all joints or of each."""
    difference: EachNumber = (0.0,)
    """Half of what viscous friction forwards has above that backwards [N m s/rad], of all joints or of each."""
    edge: Positive = 0.002
    """Speed over which the offset rises [rad/s]: a joint that stands is not pushed."""
    viscous: EachNotNegativeOrNone = None
    """Fv [N m s/rad], of all joints or of each; without it the robot's own."""
    coulomb: EachNotNegativeOrNone = None
    """Fs [N m], of all joints or of each; without it the robot's own."""

    @property
    def steady(self) -> bool:
        """False."""
        return False

    def truth(self, robot: Robot) -> dict[str, float]:
        """Return off and Fva."""
        pairs = (("off", self._each("offset", robot.n)), ("Fva", self._each("difference", robot.n)))
        return {f"{letters}{j + 1}": float(x) for letters, values in pairs for j, x in enumerate(values)}

    def start(self, plant: Batch, Fs: Array, h: float) -> AbstractContact:
        """Return what the directions differ by; MuJoCo makes the rest."""
        del plant, h
        n = Fs.shape[-1]
        return _Contact(self._each("offset", n), self._each("difference", n), self.edge)

    def _each(self, name: str, n: int) -> Array:
        return per_joint(getattr(self, name), n, f"friction.{name}")


class _Contact(AbstractContact):
    def __init__(self, offset: Array, difference: Array, edge: float) -> None:
        self._offset, self._difference, self._edge = offset, difference, edge

    def torque(self, qd: Array) -> Array | float:
        speed = np.abs(qd)
        found: Array = -self._offset * np.tanh(speed / self._edge) - self._difference * speed
        return found
