"""Torque that depends on the position of a rotor."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar, final

import numpy as np

from idbench.identify.arrays import Array
from idbench.identify.basis.joint_law import AbstractJointLaw
from idbench.identify.basis.parameter import Kind
from idbench.identify.errors import require_positive
from idbench.identify.signals.state import State


@final
@dataclass(frozen=True)
class Cogging(AbstractJointLaw):
    """Cogging of a known period, Cs sin(periods q) + Cc cos(periods q)."""

    asks: ClassVar[str] = "the number of periods in a turn of the joint, such as cogging:12"

    periods: float = 12.0
    """In a turn of the joint: slots and poles of the motor, times the ratio of its gear."""

    def __post_init__(self) -> None:
        require_positive(periods=self.periods)

    def letters(self) -> Mapping[str, tuple[Kind, str]]:
        """Return Cs and Cc."""
        return {"Cs": ("other", "N m"), "Cc": ("other", "N m")}

    def torques(self, state: State) -> Mapping[str, Array]:
        """Return sine and cosine."""
        return {"Cs": np.sin(self.periods * state.q), "Cc": np.cos(self.periods * state.q)}
