"""Balancers: springs and gas springs between two points."""

from dataclasses import dataclass

import numpy as np

from idbench.identify.arrays import Array
from idbench.identify.basis.block import AbstractConservativeBlock, AbstractWithoutMomentum, BlockColumns, Parameter
from idbench.identify.errors import SettingError, require_finite, require_positive
from idbench.identify.signals.signals import State


@dataclass(frozen=True)
class Spring(AbstractWithoutMomentum, AbstractConservativeBlock):
    """Springs of joints, K (q - rest); where the rest position is not known, `offset` takes its torque."""

    rest: tuple[float, ...] = (0.0,)
    """Position without a torque [rad or m], of all joints or of each."""

    def parameters(self, n: int) -> tuple[Parameter, ...]:
        """Return K of each joint."""
        return tuple(map(_stiffness, range(n)))

    def remainder(self, state: State) -> BlockColumns:
        """Return q - rest."""
        return {(j, _stiffness(j)): self._bent(state, j) for j in range(state.n)}

    def energy(self, state: State) -> BlockColumns:
        """Return (q - rest)^2 / 2."""
        return {(0, _stiffness(j)): 0.5 * self._bent(state, j) ** 2 for j in range(state.n)}

    def _bent(self, state: State, j: int) -> Array:
        if len(self.rest) not in (1, state.n):
            raise SettingError(f"{len(self.rest)} rest positions of springs for {state.n} joints: give one, or one per joint")
        return state.q[..., j, :] - np.broadcast_to(self.rest, (state.n,))[j]


def _stiffness(j: int) -> Parameter:
    return Parameter("K", j, "stiffness", "N m/rad")


@dataclass(frozen=True)
class Balancer(AbstractWithoutMomentum, AbstractConservativeBlock):
    """A balancer of a joint, between a point of its link and one that stands: a spring, and a hydraulic gas spring.

    Its length is l = sqrt(a^2 + b^2 - 2 a b cos(q - zero)), a and b the distances of the points from the axis. The spring pulls
    with F0 + Kb (l - least); the gas, behind a piston that oil moves, with Fg (V/(V - l + least))^kappa, its volume V as a
    length of the stroke. With geometry and V from a drawing, F0, Kb and Fg are linear: A. Klimchik et al., "Geometric and
    elastostatic calibration of robotic manipulator with gravity compensator", IROS 2013, for the geometry.
    """

    joint: int = 1
    """Of the robot, from 0."""
    a: float = 0.2
    """Distance of the point on the link from the axis [m]."""
    b: float = 0.6
    """Distance of the fixed point from the axis [m]."""
    zero: float = 0.0
    """Position of the joint at which both points lie in one direction from the axis [rad]."""
    volume: float | None = None
    """V, gas volume over the area of the piston [m], longer than the stroke of a whole turn; without it there is no gas."""
    kappa: float = 1.2
    """1 of slow, 1.4 of fast motion (nitrogen)."""

    def __post_init__(self) -> None:
        require_positive(a=self.a, b=self.b, kappa=self.kappa, volume=1.0 if self.volume is None else self.volume)
        require_finite(zero=self.zero)
        if self.a == self.b:
            raise SettingError(f"a = b = {self.a:g} m: the ends of a balancer do not meet")
        if self.volume is not None and self.volume <= (stroke := 2 * min(self.a, self.b)):
            raise SettingError(f"volume = {self.volume:g} m must be longer than the stroke of a whole turn, {stroke:g} m")

    def parameters(self, n: int) -> tuple[Parameter, ...]:
        """Return F0 and Kb, and Fg of one with gas."""
        return tuple(map(self._parameter, ("F0", "Kb", *(("Fg",) if self.volume is not None else ()))))

    def remainder(self, state: State) -> BlockColumns:
        """Return forces times dl/dq."""
        stroke, slope = self._stroke(state.q[..., self.joint, :])
        forces = {"F0": np.ones_like(stroke), "Kb": stroke}
        if self.volume is not None:
            forces["Fg"] = (self.volume / (self.volume - stroke)) ** self.kappa
        return {(self.joint, self._parameter(x)): force * slope for x, force in forces.items()}

    def energy(self, state: State) -> BlockColumns:
        """Return the integrals of the forces over the length."""
        stroke, _ = self._stroke(state.q[..., self.joint, :])
        works = {"F0": stroke, "Kb": stroke**2 / 2}
        if self.volume is not None:
            V, k = self.volume, self.kappa
            works["Fg"] = -V * np.log(1 - stroke / V) if k == 1 else V / (k - 1) * ((1 - stroke / V) ** (1 - k) - 1)
        return {(0, self._parameter(x)): work for x, work in works.items()}

    def _parameter(self, letters: str) -> Parameter:
        return Parameter(letters, self.joint, "stiffness", "N/m" if letters == "Kb" else "N")

    def _stroke(self, q: Array) -> tuple[Array, Array]:
        """Return l - least and dl/dq."""
        angle = q - self.zero
        length = np.sqrt(self.a**2 + self.b**2 - 2 * self.a * self.b * np.cos(angle))
        return length - abs(self.a - self.b), self.a * self.b * np.sin(angle) / np.maximum(length, 1e-9)
