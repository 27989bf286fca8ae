"""Stribeck friction."""

from typing import Annotated, final

import numpy as np
from mujoco.batch import Batch
from pydantic import Field

from idbench.sim.frictions.friction_law import AbstractContact, AbstractFrictionLaw
from idbench.sim.robot.motors import Array
from idbench.sim.robot.robot import Robot
from idbench.sim.settings import EachNotNegativeOrNone, Number, Positive, settings


@final
@settings
class Stribeck(AbstractFrictionLaw):
    """Stribeck: Fs (1 + (static - 1) exp(-(qd/velocity)^2)) sign(qd) + Fv qd."""

    static: Annotated[Number, Field(ge=1)] = 1.5
    """Friction at the brink of motion, in multiples of Fs."""
    velocity: Positive = 0.1
    """Stribeck velocity [rad/s]: above it the rise is gone."""
    viscous: EachNotNegativeOrNone = None
    """Fv [N m s/rad], of all joints or of each; without it the robot's own."""
    coulomb: EachNotNegativeOrNone = None
    """Fs [N m], of all joints or of each; without it the robot's own."""

    @property
    def steady(self) -> bool:
        """False."""
        return False

    def truth(self, robot: Robot) -> dict[str, float]:
        """Return Fst and vs."""
        rise = (self.static - 1) * robot.model.dof_frictionloss
        return {f"Fst{j + 1}": float(x) for j, x in enumerate(rise)} | {f"vs{j + 1}": self.velocity for j in range(robot.n)}

    def start(self, plant: Batch, Fs: Array, h: float) -> AbstractContact:
        """Return the law, which sets MuJoCo's Coulomb friction anew in every step: its constraint keeps standing joints."""
        del h
        return _Contact(self, plant.expand("dof_frictionloss"), Fs)


class _Contact(AbstractContact):
    def __init__(self, settings: Stribeck, frictionloss: Array, Fs: Array) -> None:
        self._settings, self._frictionloss, self._Fs = settings, frictionloss, Fs.copy()

    def torque(self, qd: Array) -> Array | float:
        rise = (self._settings.static - 1) * np.exp(-((qd / self._settings.velocity) ** 2))
        self._frictionloss[:] = self._Fs * (1 + rise)
        return 0.0
