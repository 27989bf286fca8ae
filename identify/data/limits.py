"""Limits of a robot's joints."""

from dataclasses import dataclass

import numpy as np

from idbench.identify.arrays import Array, frozen
from idbench.identify.errors import SettingError

MIN_LIMIT = 1e-6
"""Limits below this are a slip."""


@dataclass(frozen=True, eq=False)
class Limits:
    """Limits of the joints; infinite where there are none."""

    position: Array
    """Lowest and highest [rad], finite, shape (joint, 2)."""
    velocity: Array
    """[rad/s], [rad/s^2], [rad/s^3]; velocities finite, shape (joint,)."""
    acceleration: Array
    """[rad/s], [rad/s^2], [rad/s^3]; velocities finite, shape (joint,)."""
    jerk: Array
    """[rad/s], [rad/s^2], [rad/s^3]; velocities finite, shape (joint,)."""
    torque: Array
    """Largest, and on average over the motion [N m], shape (joint,)."""
    rms_torque: Array
    """Largest, and on average over the motion [N m], shape (joint,)."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "position", frozen(self.position))
        n = len(self.position)
        for name in ("velocity", "acceleration", "jerk", "torque", "rms_torque"):
            values = frozen(np.broadcast_to(getattr(self, name), n))
            if not (values >= MIN_LIMIT).all():
                raise SettingError(f"limits: {name} = {values.tolist()} must be at least {MIN_LIMIT:g}")
            object.__setattr__(self, name, values)
        if self.position.shape != (n, 2) or not (self.position[:, 0] < self.position[:, 1]).all():
            raise SettingError(f"limits: position = {self.position.tolist()} must be pairs, the lowest first")

    @property
    def middle(self) -> Array:
        """Middle of the ranges [rad], shape (joint,)."""
        return np.asarray(self.position.mean(axis=1))

    @property
    def sizes(self) -> Array:
        """Half of the ranges, and the largest velocity, acceleration and jerk, shape (4, 1, joint)."""
        half = np.diff(self.position, axis=1)[:, 0] / 2
        return np.stack([half, self.velocity, self.acceleration, self.jerk])[:, None]
