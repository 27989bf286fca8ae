"""Reversals inside the cells of a motion, and how columns jump there."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from idbench.identify.arrays import Array
from idbench.identify.basis.basis import Basis
from idbench.identify.noise.linearization import observation

CREEP = 1e-9
"""Speed [rad/s, of slides m/s] that stands for a sign: friction has its jump there, and nothing else changes."""

Ints = npt.NDArray[np.intp]


@dataclass(frozen=True, eq=False)
class Inside:
    """Reversals inside cells, as a motion has them."""

    joint: Ints
    """Which joint, and where, shape (reversal,)."""
    cell: Ints
    """Which joint, and where, shape (reversal,)."""
    share: Array
    """Share of the cell that lies before the reversal, shape (reversal,)."""
    slope: Array
    """Its derivative by the velocity at the first and the second node, shape (reversal, 2)."""
    sign: Array
    """Signs of the velocities, 0 where they have their own, shape (joint, cell)."""

    def jumps(self, basis: Basis, points: list[tuple[Array, Array, Array]], D: Array, part: slice) -> "Jumps":
        """Return what reversals in a part of the cells change, of columns D, shape (point, cell, joint, p), at two points."""
        which = np.flatnonzero((self.cell >= part.start) & (self.cell < part.stop))
        cell, joint, every = self.cell[which] - part.start, self.joint[which], np.arange(len(which))
        after = []
        for (q, qd, qdd), before in zip(points, D, strict=True):
            turned = qd[:, cell].copy()
            turned[joint, every] = -np.copysign(CREEP, self.sign[joint, self.cell[which]])
            after.append(observation(basis, q[:, cell], turned, qdd[:, cell]) - before[cell])
        return Jumps(cell, joint, np.stack(after), self.share[which], self.slope[which])


@dataclass(frozen=True, eq=False)
class Jumps:
    """How columns jump inside cells, at the instants at which joints reverse.

    A function that is 0 up to the share s of a cell, and 1 then, has the mean 1 - s, and the first moment of a straight line
    that differs by 2 sqrt(3) s (1 - s) between the Gauss points: so much of the jump have the mean torque, and the difference.
    """

    cell: Ints
    """Where, shape (reversal,)."""
    joint: Ints
    """Where, shape (reversal,)."""
    change: Array
    """Columns afterwards less those before, shape (point, reversal, joint, p)."""
    share: Array
    """See `Inside`, shape (reversal,)."""
    slope: Array
    """See `Inside`, shape (reversal, 2)."""

    def add(self, W: Array, H: Array, X: Array, sign: float) -> None:
        """Add them to the mean, or with sign -1 to half the difference, of W, shape (cell, joint, p), and of its slopes H X."""
        s, mean, n = self.share, (self.change[1] + self.change[0]) / 2, W.shape[1]
        weight, slope = (1 - s, -np.ones_like(s)) if sign > 0 else (np.sqrt(3) * s * (1 - s), np.sqrt(3) * (1 - 2 * s))
        added = weight[:, None, None] * mean
        if sign < 0:
            added += (1 - s)[:, None, None] * (self.change[1] - self.change[0]) / 2
        np.add.at(W, self.cell, added)
        torque = slope[:, None] * np.matmul(mean, X)
        by_node = np.moveaxis(H, 1, -1)
        for node in (0, 1):
            np.add.at(by_node, (self.cell, (1 + 2 * node) * n + self.joint), torque * self.slope[:, node : node + 1])


def signed(qd: Array, sign: Array) -> Array:
    """Return velocities that have these signs, shape (joint, cell); 0 leaves them their own."""
    return np.where(sign * qd < CREEP * np.abs(sign), sign * CREEP, qd)
