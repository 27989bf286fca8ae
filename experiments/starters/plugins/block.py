"""A friction law that is identified: columns of a parameter that all models see."""

from dataclasses import dataclass

import numpy as np

from idbench.identify import AbstractFriction, Array


@dataclass(frozen=True)
class Starter(AbstractFriction):
    """Drag that grows with the square of the velocity, Fq |qd| qd."""

    symbol = "Fq"
    """The parameter of joint 1 is called Fq1, and so on; no other block may use the symbol."""
    unit = "N m s^2/rad^2"

    def force(self, q: Array, qd: Array) -> Array:
        """Return the torque of a joint for Fq = 1, at every instant [s^2/rad^2 times the unit]."""
        return np.abs(qd) * qd
