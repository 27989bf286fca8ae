"""The signals that identification models are made of: motion, torque and mask weights of one log."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from math import ceil
from typing import Any, Self, TypeVar
from weakref import proxy

import numpy as np

from idbench.identify.arrays import Array
from idbench.identify.blame import expect, expect_kind
from idbench.identify.data.motion_log import MotionLog, TorqueChannel
from idbench.identify.errors import LogError
from idbench.identify.signals.filters import AbstractDifferentiator
from idbench.identify.signals.masks import AbstractMask
from idbench.identify.signals.prefilters import AbstractPrefilter
from idbench.identify.signals.torques import AbstractAlignment, Torque

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

    def condition(self, name: str) -> Array:
        """A further column of the log, shape (..., joint or 1, time); raise LogError if there is none."""
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

    def part(self, samples: slice) -> Self:
        """Return the motion at some samples, with its velocities and accelerations there; its `s` knows no others.

        All who ask for the same samples get the same motion, as long as the whole is there.
        """
        return self.shared((samples.start, samples.stop), lambda _: self._part(samples))

    def _part(self, samples: slice) -> Self:
        conditions = {name: x[..., samples] for name, x in self.conditions.items()}
        whole = proxy(self)  # a circle of references would outlive long pieces
        return replace(
            self, q=self.q[..., samples], qd=self.qd[..., samples], s=lambda _: whole.qdd[..., samples], conditions=conditions
        )

    def shared(self, key: object, make: Callable[[Self], T]) -> T:
        """Return `make(self)`, computed once for all that ask with the same `key`."""
        if key not in self._shared:
            self._shared[key] = make(self)
        return self._shared[key]

    def latest(self, key: object, make: Callable[[Self], T]) -> T:
        """Return `make(self)`, kept until somebody asks with another `key`: what is large does not add up."""
        kept = self._shared.get("latest")
        if kept is None or kept[0] is not key:
            kept = self._shared["latest"] = key, make(self)
        return kept[1]

    def forget(self) -> None:
        """Drop what was computed once for all: it takes far more memory than the motion, and is not needed twice."""
        self._shared.clear()

    @cached_property
    def _shared(self) -> dict[object, Any]:
        return {}


@dataclass(frozen=True, eq=False)
class Signals:
    """The signals of one log, each computed once, when it is first asked for; time is the last axis."""

    log: MotionLog
    """One log; leading axes are independent runs."""
    prefilter: AbstractPrefilter
    """Applied to positions and torques."""
    differentiator: AbstractDifferentiator
    """The operator s."""
    alignment: AbstractAlignment
    """Puts the torque on the time of the positions."""
    mask: AbstractMask
    """Gives the weights of the instants."""
    weights_of: "Signals | None" = None
    """Signals whose weights are taken instead of those of the mask."""

    @property
    def fs(self) -> float:
        """Sampling frequency [Hz]."""
        return self.log.fs

    @cached_property
    def state(self) -> State:
        """Prefiltered positions and their derivatives."""
        q = self._prefiltered(self.log.q)
        qd = expect(self.differentiator, "derivative", self.s(q), q.shape)
        derivative, fs = self.differentiator.derivative, self.fs  # not self.s: a circle of references would outlive long pieces
        conditions = {name: np.swapaxes(x, -1, -2) for name, x in self.log.conditions.items()}
        if self.log.motion:
            rates, accelerations = (np.broadcast_to(np.swapaxes(x, -1, -2), q.shape) for x in self.log.motion)
            return State(q, rates, lambda _: accelerations, conditions)
        if self.log.poses:
            return State(q, np.zeros_like(q), np.zeros_like, conditions)
        return State(q, qd, lambda x: derivative(x, fs), conditions)

    @cached_property
    def torque(self) -> Torque:
        """The prefiltered torque, aligned."""
        tau = self._prefiltered(self.log.tau * np.asarray(self.log.torque.gain))
        return self._aligned(tau, self.log.torque)

    @cached_property
    def weight(self) -> Array:
        """Weights of the instants, between 0 and 1, shape (..., joint, time)."""
        if self.weights_of is not None:
            return self.weights_of.weight
        weight = self.mask.suited(self.state.qd).weight(self.state.qd, self.fs)
        weight = expect(self.mask, "weight", weight, self.state.q.shape)
        if self.log.missing:
            weight = weight.copy()
            weight[..., list(self.log.missing), :] = 0.0
        return weight

    def s(self, x: Array) -> Array:
        """Return dx/dt of `x`, shape (..., time)."""
        return self.differentiator.derivative(x, self.fs)

    @cached_property
    def gain(self) -> float:
        """Standard deviation of the velocities that white noise of the positions makes, over that of the noise [1/s]."""
        reach = ceil((self.prefilter.halo(self.fs) + self.differentiator.halo(self.fs)) * self.fs - 1e-9)
        impulse = np.zeros(6 * reach + 101)
        impulse[len(impulse) // 2] = 1.0
        return float(np.linalg.norm(self.s(self.prefilter.apply(impulse, self.fs))))

    def torque_adjoint(self, z: Array) -> Array:
        """Return the adjoint of prefilter and alignment at `z`, shape (..., time).

        Both act alike at all times, so that their adjoint is what they do in reversed time (away from the ends of the log). It
        is that of a joint without a lag of its own: what a row looks at changes little over a lag.
        """
        back = self.prefilter.apply(z[..., ::-1], self.fs)
        return self._aligned(back, replace(self.log.torque, lags=())).mean[..., ::-1]

    def position_adjoint(self, z: tuple[Array, Array, Array]) -> Array:
        """Return the adjoint of q -> (q, s q, s^2 q), prefilter included, at three signals of shape (..., time)."""
        back = [x[..., ::-1] for x in z]
        return self.prefilter.apply(back[0] + self.s(back[1] + self.s(back[2])), self.fs)[..., ::-1]

    def _aligned(self, tau: Array, channel: TorqueChannel) -> Torque:
        return expect_kind(self.alignment, "align", self.alignment.align(tau, channel, self.fs), Torque)

    def _prefiltered(self, x: Array) -> Array:
        signal = np.ascontiguousarray(np.swapaxes(x, -1, -2))
        return expect(self.prefilter, "apply", self.prefilter.apply(signal, self.fs), signal.shape)
