"""How the joints move: what the column functions of a basis are functions of."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, Self, TypeVar

from idbench.identify.arrays import Array
from idbench.identify.errors import LogError

T = TypeVar("T")


@dataclass(frozen=True, eq=False)
class State:
    """Positions, velocities and accelerations of n joints, with time as the last axis.

    What several column functions need of it is computed once, when the first of them asks.
    """

    q: Array
    """Positions [rad], shape (..., joint, time)."""
    qd: Array
    """Velocities [rad/s], shape (..., joint, time)."""
    s: Callable[[Array], Array]
    """d/dt along the last axis; only asked for accelerations."""
    conditions: Mapping[str, Array] = field(default_factory=dict)
    """What else the log says, such as temperatures, shape (..., joint or 1, time)."""

    @classmethod
    def of(cls, q: Array, s: Callable[[Array], Array], conditions: Mapping[str, Array] | None = None) -> Self:
        """Return the state of positions [rad], shape (..., joint, time)."""
        return cls(q, s(q), s, conditions or {})

    def condition(self, name: str) -> Array:
        """Return what else the log says, shape (..., joint or 1, time); raise LogError if it says nothing of it."""
        if name not in self.conditions:
            known = ", ".join(self.conditions) or "nothing beside motion and torque"
            raise LogError(f"the log does not say the {name} that a law needs; it has {known}: see `idbench log`")
        return self.conditions[name]

    @property
    def n(self) -> int:
        """Number of joints."""
        return int(self.q.shape[-2])

    @cached_property
    def qdd(self) -> Array:
        """Joint accelerations [rad/s^2], shape (..., joint, time); only the explicit model asks for them."""
        return self.s(self.qd)

    def shared(self, key: object, make: Callable[[Self], T]) -> T:
        """Return `make(self)`, computed once for all that ask with the same `key`."""
        if key not in self._shared:
            self._shared[key] = make(self)
        return self._shared[key]

    def forget(self) -> None:
        """Drop what was computed once for all: it takes far more memory than the motion, and is not needed twice."""
        self._shared.clear()

    @cached_property
    def _shared(self) -> dict[object, Any]:
        return {}
