"""A kind of motion that `idbench excite` designs: linear in its coefficients, at rest where it begins and ends."""

from dataclasses import dataclass

import numpy as np

from idbench.experiments.excite.excitation import REST, AbstractExcitation
from idbench.identify import Array
from idbench.identify.design.plan import Plan
from idbench.identify.design.shapes import Shapes
from idbench.sim.trajectories import Fourier


@dataclass(frozen=True)
class Starter(AbstractExcitation):
    """Sums of sin(k w t)^3 about any position: sines whose harmonics cancel velocity and acceleration at the ends."""

    def shapes(self, t: Array, duration: float, frequency: float) -> Shapes:
        """Return a constant, and sin^3 = (3 sin x - sin 3x) / 4 of every harmonic, with their derivatives."""
        w = 2 * np.pi * np.arange(1, _count(duration, frequency) + 1) / duration
        orders = np.arange(4)[:, None, None]
        one, three = (v**orders * np.sin(v * t[:, None] + orders * np.pi / 2) for v in (w, 3 * w))
        constant = np.broadcast_to(orders == 0, (4, len(t), 1))
        return Shapes(np.concatenate([constant, (3 * one - three) / 4], axis=-1))

    def random(self, rng: np.random.Generator, plan: Plan, duration: float, frequency: float) -> Array:
        """Return random coefficients, shape (m, joint)."""
        return rng.standard_normal((plan.states.count, len(plan.limits.velocity)))

    def trajectory(self, c: Array, middle: Array, duration: float, repeat: int) -> Fourier:
        """Return the series of these coefficients: that of harmonic k has sines at k and 3 k."""
        sines = np.zeros((3 * (len(c) - 1), c.shape[1]))
        for k, row in enumerate(c[1:], 1):
            sines[k - 1] += 0.75 * row
            sines[3 * k - 1] -= 0.25 * row
        rows = tuple(tuple(map(float, row)) for row in sines)
        still = ((0.0,) * c.shape[1],) * len(rows)
        return Fourier(duration, tuple(map(float, c[0] + middle)), rows, still, repeat, rest=REST)


def _count(duration: float, frequency: float) -> int:
    """Return the harmonics up to a third of the frequency, at least one."""
    return max(1, int(duration * frequency / 3))
