"""Gains of drives."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Self, final

import numpy as np

from idbench.identify.arrays import Array, combined
from idbench.identify.basis.basis import Basis
from idbench.identify.basis.joint_law import AbstractJointLaw
from idbench.identify.basis.parameter import Kind, Parameter
from idbench.identify.signals.state import State


@final
@dataclass(frozen=True)
class DriveGains(AbstractJointLaw):
    """What the gain of a drive is in multiples of the one that a log was read with, kg.

    With the torque g i of a current i, g = kg g0, the rows of joint j are g0 i = model / kg, linear about kg = 1 and the torque
    of the model by an estimate. The column does not contain the current's noise, so there is no bias as in least squares of
    currents, nor are errors in all variables assumed as in total least squares: M. Gautier and S. Briot, "Global identification
    of joint drive gains and dynamic parameters of robots", J. Dynamic Systems, Measurement, and Control 136 (2014) 051025.
    """

    model: Basis | None = None
    """The robot without the gains."""
    X: Array | None = None
    """Its parameters, as estimated before, shape (..., p)."""

    @property
    def is_nonlinear(self) -> bool:
        """True."""
        return True

    def letters(self) -> Mapping[str, tuple[Kind, str]]:
        """Return kg."""
        return {"kg": ("other", "1")}

    def torques(self, state: State) -> Mapping[str, Array]:
        """Return the torque of the model, with the other sign; before there is one, ones."""
        if self.model is None or self.X is None:
            return {"kg": np.ones_like(state.qd)}
        return {"kg": -combined(self.model.explicit(state), self.X, np.zeros(state.q.shape))}

    def operating_point(self, n: int) -> Mapping[Parameter, Array | float]:
        """Return ones."""
        return dict.fromkeys(self.parameters(n), 1.0) if self.model is not None else {}

    def adapted(self, basis: Basis, X: Array) -> Self:
        """Return the gains about an estimate."""
        model = basis.of([parameter for parameter in basis.parameters if parameter not in self.parameters(basis.n)])
        return replace(self, model=model, X=X[..., [basis.places[parameter] for parameter in model.parameters]])
