"""A payload that the controller does not know."""

from math import pi
from typing import Annotated, final

import mujoco
from pydantic import Field

from idbench.sim.errors import ScenarioError
from idbench.sim.settings import NotNegative, Number, settings


@final
@settings
class Payload:
    """A mass bolted to the last link. It is part of the truth, and unknown to the controller."""

    mass: Annotated[Number, Field(ge=0, le=1e5)] = 0.0
    """[kg]; 0 for no payload."""
    position: tuple[Number, Number, Number] = (0.3, 0.0, 0.0)
    """Centre of mass in the frame of the last link [m]."""
    inertia: NotNegative = 0.0
    """Moment of inertia about each axis through its centre of mass [kg m^2]; 0 for that of a steel ball of this mass."""

    def edit(self, spec: mujoco.MjSpec) -> None:
        """Bolt it to the body that the robot's last joint moves."""
        if not self.mass:
            if self.inertia:
                raise ScenarioError(f"payload.inertia = {self.inertia:g} kg m^2 needs a payload.mass above 0")
            return
        link = spec.joints[-1].parent
        body = link.add_body(name="payload", pos=list(self.position))
        body.mass = self.mass
        body.inertia = [self._inertia] * 3
        body.ipos = [0, 0, 0]
        body.explicitinertial = True

    @property
    def _inertia(self) -> float:
        """2/5 m r^2 of a ball of 7850 kg/m^3, where no inertia is given."""
        radius = (3 * self.mass / (4 * pi * 7850)) ** (1 / 3)
        return self.inertia or 0.4 * self.mass * radius**2
