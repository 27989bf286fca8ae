"""What the last link holds."""

from collections.abc import Mapping, Set
from dataclasses import dataclass, replace
from functools import cached_property
from typing import ClassVar, Self

import numpy as np

from idbench.identify.arrays import Array, combined
from idbench.identify.basis.basis import Basis
from idbench.identify.basis.block import AbstractColumns, AbstractConservativeBlock, BlockColumns, Kind, Parameter
from idbench.identify.basis.joint_law import AbstractJointLaw
from idbench.identify.basis.tree_links import TreeLinks
from idbench.identify.data.kinematics import KinematicTree
from idbench.identify.errors import SettingError
from idbench.identify.signals.signals import State


@dataclass(frozen=True)
class DriveGains(AbstractJointLaw):
    """What the gain of a drive is in multiples of the one that a log was read with, kg.

    With the torque g i of a current i, g = kg g0, the rows of joint j are g0 i = model / kg, linear about kg = 1 and the torque
    of the model by an estimate. The column does not contain the current's noise, so there is no bias as in least squares of
    currents, nor are errors in all variables assumed as in total least squares: M. Gautier and S. Briot, "Global identification
    of joint drive gains and dynamic parameters of robots", J. Dynamic Systems, Measurement, and Control 136 (2014) 051025.
    """

    is_nonlinear: ClassVar[bool] = True

    model: Basis | None = None
    """The robot without the gains."""
    X: Array | None = None
    """Its parameters, as estimated before, shape (..., p)."""

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


HELD_SHARE = "payload"  # Condition of a log: the share of the payload that is held, 0 without and 1 with it


@dataclass(frozen=True, eq=False)
class PayloadLink(AbstractConservativeBlock, AbstractColumns):
    """A payload on a link, XXL XYL XZL YYL YZL ZZL MXL MYL MZL ML in the frame of the link, in the logs that have it.

    W. Khalil, M. Gautier and P. Lemoine, "Identification of the payload inertial parameters of industrial manipulators", IEEE
    ICRA 2007.
    """

    tree: KinematicTree
    """The robot."""
    link: int
    """Number of the joint whose link holds it, from 0."""
    only: frozenset[Parameter] | None = None
    """Parameters whose columns are computed; all by default."""

    def parameters(self, n: int) -> tuple[Parameter, ...]:
        """Return the ten parameters; raise SettingError unless the tree has `n` joints."""
        if not (own := [p for p in self._links.parameters(n) if p.joint == self.link]):
            raise SettingError(f"joint {self.tree.joints[self.link].name} moves no link with mass that could hold a payload")
        return tuple(map(_own, own))

    def narrowed(self, parameters: Set[Parameter]) -> Self:
        """Return this block without the work for other parameters."""
        return replace(self, only=frozenset(parameters))

    def columns(self, function: str, state: State) -> BlockColumns:
        """Return those of the link, in the share of the payload that is held."""
        if not np.any(share := state.condition(HELD_SHARE)[..., 0, :]):
            return {}
        return {(row, _own(p)): share * column for (row, p), column in self._links.columns(function, state).items()}

    @cached_property
    def _links(self) -> TreeLinks:
        own = (p for p in TreeLinks(self.tree).parameters(self.tree.n) if p.joint == self.link)
        return TreeLinks(self.tree, frozenset(p for p in own if self.only is None or _own(p) in self.only))


def _own(parameter: Parameter) -> Parameter:
    """Return the parameter of the payload that is what one of the link is: MXL of MX6."""
    return replace(parameter, symbol=f"{parameter.symbol}L", joint=None)
