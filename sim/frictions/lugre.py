"""LuGre friction."""

from typing import Annotated

import numpy as np
from pydantic import Field

from idbench.sim.errors import ScenarioError
from idbench.sim.frictions.friction_law import AbstractContact, AbstractFrictionLaw, CompiledContact, PlantJoints
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

    def start(self, plant: PlantJoints, Fs: Array, h: float) -> AbstractContact:
        """Return unbent bristles; MuJoCo's own Coulomb friction is switched off.

        Raises
        ------
        ScenarioError
            If the bristles are too stiff for the physics step.
        """
        stiffness, inertia = Fs / self.deflection, 1 / plant.expand("dof_invweight0")
        swift = np.sqrt(stiffness / inertia) * h
        if (swift > 0.5).any():
            raise ScenarioError(
                f"friction.deflection = {self.deflection:g} rad makes bristles that swing within {h:g} s: raise it to "
                f"{self.deflection * (swift.max() / 0.5) ** 2:.2g} rad, or lower physics.step"
            )
        plant.expand("dof_frictionloss")[:] = 0.0
        damping = 2 * self.damping * np.sqrt(stiffness * inertia)
        return CompiledContact("lugre", Fs.shape, (Fs, self.deflection, self.static, self.velocity, damping, 0.0), h)


@settings
class Dahl(AbstractFrictionLaw):
    """Dahl: bristles that bend and slip, Coulomb friction with hysteresis (P. Dahl, AIAA Journal 14 (1976) 1675-1682).

    dz/dt = qd - |qd| z / deflection, torque = Fs z / deflection + Fv qd: LuGre friction without stiction or damping.
    """

    deflection: Positive = 1e-3
    """Bristle deflection at which Fs is reached [rad]: stiffness is Fs over it."""

    def start(self, plant: PlantJoints, Fs: Array, h: float) -> AbstractContact:
        """Return unbent bristles."""
        return LuGre(deflection=self.deflection, damping=0.0, static=1.0).start(plant, Fs, h)
