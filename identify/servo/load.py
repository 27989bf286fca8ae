"""What a servo carries: the torque that the links need of one joint."""

from dataclasses import dataclass
from typing import Self, final

import numpy as np

from idbench.identify.arrays import Array, frozen
from idbench.identify.errors import SettingError, require_positive

G = 9.81
"""Gravity of a pendulum on a bench [m/s^2]."""


@final
@dataclass(frozen=True, eq=False)
class JointLoad:
    """The torque that the links need of one joint, J qdd + sine sin(q) + cosine cos(q) + rest, q being the angle of the file.

    Exact for one joint. Of an arm, the other joints move as they were measured: J and the coefficients then vary over time, and
    `rest` has what their accelerations and velocities need.
    """

    inertia: Array
    """J [kg m^2], shape (time,) or ()."""
    sine: Array
    """Shape (time,) or () [N m]."""
    cosine: Array
    """Shape (time,) or () [N m]."""
    rest: Array
    """Shape (time,) or () [N m]."""

    def __post_init__(self) -> None:
        for name in ("inertia", "sine", "cosine", "rest"):
            values = frozen(getattr(self, name))
            if values.ndim > 1 or not np.isfinite(values).all():
                raise SettingError(f"{name} of a load must be finite numbers, of the shape (time,) or one number")
            object.__setattr__(self, name, values)
        if (self.inertia < 0).any():
            raise SettingError(f"inertia = {self.inertia.min():g} kg m^2 of a load must not be negative")

    @classmethod
    def pendulum(cls, mass: float, length: float) -> Self:
        """Return a point mass [kg] at a distance [m] from the axis, which is horizontal; q = 0 hangs down.

        Examples
        --------
        >>> from idbench.identify.servo import JointLoad
        >>> round(float(JointLoad.pendulum(0.5, 0.1).sine), 4)
        0.4905
        """
        require_positive(mass=mass, length=length)
        none = np.array(0.0)
        return cls(np.array(mass * length**2), np.array(mass * G * length), none, none)

    def torque(self, q: Array) -> Array:
        """Return the torque that keeps the joint at q [rad] while the others move as measured [N m]."""
        return np.asarray(self.sine * np.sin(q) + self.cosine * np.cos(q) + self.rest)
