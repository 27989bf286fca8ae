"""Friction that changes with the temperature."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import final

import numpy as np

from idbench.identify.arrays import Array
from idbench.identify.basis.joint_law import AbstractJointLaw
from idbench.identify.basis.parameter import Kind
from idbench.identify.signals.state import State


@final
@dataclass(frozen=True)
class TemperatureFriction(AbstractJointLaw):
    """Friction that changes with the logged temperature T, (FvT qd + FsT sign(qd)) (T - reference)."""

    reference: float = 25.0
    """Temperature at which Fv and Fs are what they are alone [deg C]."""

    def letters(self) -> Mapping[str, tuple[Kind, str]]:
        """Return FvT and FsT."""
        return {"FvT": ("friction", "N m s/rad/K"), "FsT": ("friction", "N m/K")}

    def torques(self, state: State) -> Mapping[str, Array]:
        """Return (T - reference) times qd, and times its sign."""
        above = state.condition("temperature") - self.reference
        return {"FvT": above * state.qd, "FsT": above * np.sign(state.qd)}
