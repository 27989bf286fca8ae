"""Friction as a smooth function of velocity, without a law."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from idbench.identify.arrays import Array
from idbench.identify.basis.block import Kind
from idbench.identify.basis.joint_law import AbstractJointLaw
from idbench.identify.errors import require_positive
from idbench.identify.signals.signals import State

CENTRES = tuple(float(x) for x in np.linspace(-4, 4, 17))
"""Centres of the bumps, in asinh(qd/v): with v a tenth of the rms speed they reach 2.7 times it, in either direction."""

WIDTH = 0.5  # Width of a bump, which is their distance


@dataclass(frozen=True)
class SmoothFriction(AbstractJointLaw):
    """Friction as a smooth function of velocity, sum over k of u_k exp(-(asinh(qd/v) - c_k)^2 / (2 w^2)), beside other laws.

    Its parameters are no physical ones: they are random effects, whose size the log decides.
    """

    asks: ClassVar[str] = "the velocity [rad/s] below which it is fine, a tenth of the joint's rms speed, such as smooth:0.1"

    v: float = 0.1
    """Velocity [rad/s] up to which bumps are equally wide; beyond it they grow with the velocity."""

    def __post_init__(self) -> None:
        require_positive(v=self.v)

    def letters(self) -> Mapping[str, tuple[Kind, str]]:
        """Return u_1_ to u_17_."""
        return {f"u{k + 1}_": ("smooth friction", "N m") for k in range(len(CENTRES))}

    def torques(self, state: State) -> Mapping[str, Array]:
        """Return the bumps."""
        x = np.arcsinh(state.qd / self.v)
        return {f"u{k + 1}_": np.exp(-((x - c) ** 2) / (2 * WIDTH**2)) for k, c in enumerate(CENTRES)}
