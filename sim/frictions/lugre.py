"""LuGre friction."""

from typing import Annotated

import numpy as np
from mujoco.batch import Batch
from pydantic import Field

from idbench.sim.errors import ScenarioError
from idbench.sim.frictions.friction_law import AbstractContact, AbstractFrictionLaw
from idbench.sim.robot.motors import Array
from idbench.sim.settings import Number, Positive, settings


@settings
class LuGre(AbstractFrictionLaw):
    """LuGre: bristles that bend and slip; presliding, stiction and Stribeck in one (Canudas de Wit et al., 1995).

    dz/dt = qd - |qd| z / (deflection g), torque = Fs z / deflection + s1 dz/dt + Fv qd, with g = 1 + (static - 1)
    exp(-(qd/velocity)^2) and s1 = 2 damping sqrt(M Fs / deflection) exp(-(qd/velocity)^2), which fades so that the friction
    stays passive; every step is solved exactly for the speed in its middle.
    """

    deflection: Positive = 1e-3
    """Bristle deflection at which Fs is reached [rad]: stiffness is Fs over it."""
    damping: Annotated[Number, Field(ge=0, le=10)] = 1.0
    """Bristle damping ratio, against the stiffness of the bristles and the inertia of the joint."""
    static: Annotated[Number, Field(ge=1)] = 1.5
    """Friction at the brink of motion, in multiples of Fs."""
    velocity: Positive = 0.1
    """Stribeck velocity [rad/s]."""

    def start(self, plant: Batch, Fs: Array, h: float) -> AbstractContact:
        """Return unbent bristles; MuJoCo's own Coulomb friction is switched off.

        Raises
        ------
        ScenarioError
            If the bristles are too stiff for the physics step.
        """
        contact = _Contact(self, Fs, 1 / plant.expand("dof_invweight0"), h)
        plant.expand("dof_frictionloss")[:] = 0.0
        return contact


class _Contact(AbstractContact):
    def __init__(self, settings: LuGre, Fs: Array, inertia: Array, h: float) -> None:
        stiffness = Fs / settings.deflection
        swift = np.sqrt(stiffness / inertia) * h
        if (swift > 0.5).any():
            raise ScenarioError(
                f"friction.deflection = {settings.deflection:g} rad makes bristles that swing within {h:g} s: raise it to "
                f"{settings.deflection * (swift.max() / 0.5) ** 2:.2g} rad, or lower physics.step"
            )
        self._settings = settings
        self._Fs = Fs.copy()
        self._h = h
        self._damping = 2 * settings.damping * np.sqrt(stiffness * inertia)
        self._z = np.zeros(Fs.shape)  # in multiples of the deflection

    def torque(self, qd: Array) -> Array | float:
        settings = self._settings
        z0 = self._z
        u = qd / self._settings.deflection
        g = 1 + (settings.static - 1) * np.exp(-((qd / settings.velocity) ** 2))
        x = np.abs(u) * self._h / g
        kept, moved = np.exp(-x), -np.expm1(-x)
        limit = np.sign(u) * g
        self._z = limit + (z0 - limit) * kept
        mean = np.where(x > 0, limit + (z0 - limit) * moved / np.where(x > 0, x, 1.0), z0)
        # The damping fades with speed, as it must for the friction to stay passive.
        fading = self._damping * settings.deflection * np.exp(-((qd / settings.velocity) ** 2))
        return -(self._Fs * mean + fading * (self._z - z0) / self._h)


@settings
class Dahl(AbstractFrictionLaw):
    """Dahl: bristles that bend and slip, Coulomb friction with hysteresis (P. Dahl, AIAA Journal 14 (1976) 1675-1682).

    dz/dt = qd - |qd| z / deflection, torque = Fs z / deflection + Fv qd: LuGre friction without stiction or damping.
    """

    deflection: Positive = 1e-3
    """Bristle deflection at which Fs is reached [rad]: stiffness is Fs over it."""

    def start(self, plant: Batch, Fs: Array, h: float) -> AbstractContact:
        """Return unbent bristles."""
        return LuGre(deflection=self.deflection, damping=0.0, static=1.0).start(plant, Fs, h)
