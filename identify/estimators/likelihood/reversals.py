"""Where joints reverse or stop: instants at which friction jumps inside a cell, and cells in which a joint sticks."""

from dataclasses import dataclass
from typing import NamedTuple, Self

import numpy as np
import numpy.typing as npt

from idbench.identify.arrays import Array
from idbench.identify.basis.basis import Basis
from idbench.identify.estimators.likelihood.cells import Cells
from idbench.identify.noise.linearization import observation

CREEP = 1e-9  # Speed [rad/s, of slides m/s] that stands for a sign: friction has its jump there, and nothing else changes

Ints = npt.NDArray[np.intp]


@dataclass(frozen=True, eq=False)
class Inside:
    """Reversals inside cells, as a motion has them."""

    joint: Ints
    """The joint that reverses, shape (reversal,)."""
    cell: Ints
    """The cell in which it does, shape (reversal,)."""
    share: Array
    """Share of the cell that lies before the reversal, shape (reversal,)."""
    slope: Array
    """Its derivative by the velocity at the first and the second node, shape (reversal, 2)."""
    sign: Array
    """Signs of the velocities, 0 where they have their own, shape (joint, cell)."""

    def jumps(self, basis: Basis, points: list[tuple[Array, Array, Array]], D: Array, part: slice) -> "Jumps":
        """Change of the columns D, shape (point, cell, joint, p), by reversals within cells, at two points."""
        which = np.flatnonzero((self.cell >= part.start) & (self.cell < part.stop))
        cell = self.cell[which] - part.start
        joint = self.joint[which]
        every = np.arange(len(which))
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
    """The cell of the reversal, shape (reversal,)."""
    joint: Ints
    """Its joint, shape (reversal,)."""
    change: Array
    """Columns afterwards less those before, shape (point, reversal, joint, p)."""
    share: Array
    """See `Inside`, shape (reversal,)."""
    slope: Array
    """See `Inside`, shape (reversal, 2)."""

    def add(self, W: Array, H: Array, X: Array, sign: float) -> None:
        """Add them to the mean, or with sign -1 to half the difference, of W, shape (cell, joint, p), and of its slopes H X."""
        s = self.share
        mean = (self.change[1] + self.change[0]) / 2
        n = W.shape[1]
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


OUTPACED = 5.0
"""Speed over its largest change from cell to cell, in a stretch, beyond which a joint does not stop within a cell."""

RATIO = 50.0
"""Accelerations before and after a reversal differ by this factor at most: with a larger one the joint nearly sticks."""

Flags = npt.NDArray[np.bool_]


class ReversalStretch(NamedTuple):
    """Cells, begin to end, in which a joint is slow, between others in which it moves with these signs."""

    joint: int
    begin: int
    end: int
    before: float
    after: float


def stretches(qd: Array, slow: Flags) -> list[ReversalStretch]:
    """Return the stretches of slow cells, shape (joint, cell), that neither begin nor end with the log."""
    found = []
    for joint, flags in enumerate(slow):
        edges = np.flatnonzero(np.diff(flags.astype(np.int8), prepend=0, append=0))
        for begin, end in edges.reshape(-1, 2):
            if begin > 0 and end < len(flags):
                signs = np.sign(qd[joint, [begin - 1, end]])
                found.append(ReversalStretch(joint, int(begin), int(end), float(signs[0]), float(signs[1])))
    return found


@dataclass(frozen=True, eq=False)
class Forces:
    """What accelerates a joint in some cells, shape (cell,) each."""

    ahead: Array
    """Acceleration if friction is that of a motion ahead [rad/s^2]."""
    back: Array
    """Acceleration if friction is that of a motion back [rad/s^2]."""
    inertia: Array
    """Torque over acceleration [kg m^2], the other joints free."""

    @classmethod
    def of(cls, cells: Cells, basis: Basis, X: Array, z: Array, joint: int, cell: Ints) -> Self:
        """Return those of a joint in some cells of a motion z, shape (node, 2, joint)."""
        n, count = basis.n, len(cell)
        q, qd = np.mean([z[cell], z[cell + 1]], axis=0).transpose(1, 2, 0)
        moves = np.stack([qd, qd, *(0 * qd,) * (n + 1)], axis=1)
        moves[joint, :2] = np.array([CREEP, -CREEP])[:, None]
        pushes = np.zeros_like(moves)
        pushes[range(n), range(3, n + 3)] = 1.0
        states = np.repeat(q[:, None], n + 3, axis=1), moves, pushes
        D = observation(basis, *(x.reshape(n, -1) for x in states))  # ahead, back, at rest, and pushed joint by joint
        tau = np.matmul(D, X).reshape(n + 3, count, n)
        M = np.moveaxis(tau[3:] - tau[2], 0, -1)
        rest = cells.torque[0][:, cell].T - tau[:2]
        ahead, back = np.linalg.solve(M, rest[..., None])[..., joint, 0]
        return cls(ahead, back, 1 / np.linalg.inv(M)[:, joint, joint])

    def part(self, some: slice) -> Self:
        """Return those of some of the cells."""
        return type(self)(self.ahead[some], self.back[some], self.inertia[some])

    def under(self, sign: float) -> Array:
        """Return the acceleration under friction of a motion of this sign."""
        return self.ahead if sign > 0 else self.back


class Crossing(NamedTuple):
    """A velocity that crosses zero inside a cell."""

    joint: int
    cell: int
    sign: float
    """Sign of the velocity afterwards."""

    ratio: float
    """Acceleration afterwards over that before."""


@dataclass(eq=False)
class Turns:
    """What a round of steps takes for granted about slow cells."""

    crossings: list[Crossing]
    """Instants at which a joint reverses, and does not stick."""
    near: Flags
    """Slow cells whose friction is known, which have a level of their own, shape (joint, cell)."""
    sign: Array
    """Signs of the velocity in these, before the instant in the cell of a crossing; 0 elsewhere, shape (joint, cell)."""

    @classmethod
    def none(cls, shape: tuple[int, int]) -> Self:
        """Turns that leave out friction in slow cells, shape (joint, cell)."""
        return cls([], np.zeros(shape, dtype=bool), np.zeros(shape))

    @classmethod
    def of(cls, cells: Cells, basis: Basis, X: Array, z: Array, found: list[ReversalStretch], margin: Array) -> Self:
        """Turns of a motion z in stretches; `margin` is the uncertainty of torques near reversals, shape (joint,)."""
        turns = cls.none((basis.n, cells.count))
        for joint in sorted({one.joint for one in found}):
            own = [turns._slowest(one, z[one.begin : one.end, 1, joint]) for one in found if one.joint == joint]
            forces = Forces.of(cells, basis, X, z, joint, np.concatenate([np.arange(one.begin, one.end) for one in own]))
            ends = np.cumsum([0, *(one.end - one.begin for one in own)])
            for one, begin, end in zip(own, ends, ends[1:], strict=False):
                v = z[one.begin : one.end, 1, joint]
                turns._follow(one, v, forces.part(slice(begin, end)), margin[joint], cells.period)
        return turns

    def _slowest(self, one: ReversalStretch, v: Array) -> ReversalStretch:
        """Return the part of a stretch, of velocities v, shape (cell,), in which the joint may stop; mark the rest."""
        slowest = np.flatnonzero(np.abs(v) < OUTPACED * np.abs(np.diff(v)).max(initial=0.0))
        first, last = (slowest[0], slowest[-1] + 1) if len(slowest) else (0, 0)
        for cells, sign in ((slice(one.begin, one.begin + first), one.before), (slice(one.begin + last, one.end), one.after)):
            self.near[one.joint, cells], self.sign[one.joint, cells] = True, sign
        return one._replace(begin=int(one.begin + first), end=int(one.begin + last))

    def _follow(self, one: ReversalStretch, v: Array, forces: Forces, margin: float, period: float) -> None:
        """Mark where a joint of velocities v, shape (cell,), certainly moves on through a stretch, and where it reverses.

        It certainly moves while friction does not stop it within a cell. Nothing is known of the cells from the first in which
        it might stop to the last, unless the torque turns it round there at once.
        """
        if not len(v):
            return
        row = one.joint
        sign = np.full(len(v), one.before)
        step = period * margin / forces.inertia
        early, late = (s * (v + period * forces.under(s)) > step for s in (one.before, one.after))
        late &= one.after * v > -step
        if not early.all():
            first, last = int(np.argmin(early)), len(late) - 1 - int(np.argmin(late[::-1]))
            some = slice(first, last + 1)
            before, after = (one.after * forces.under(s)[some] * forces.inertia[some] for s in (one.before, one.after))
            if one.before != one.after and 0 <= last - first <= 1 and min(before.min(), after.min()) > margin:
                k = int(np.argmin(np.abs(v[some] + period / 2 * forces.under(one.before)[some])))
                ratio = float(np.clip(after[k] / before[k], 1 / RATIO, RATIO))
                self.crossings.append(Crossing(row, one.begin + first + k, one.after, ratio))
                sign[first + k + 1 :] = one.after
            else:
                sign[some], sign[max(first, last) + 1 :] = 0.0, one.after
        elif one.before != one.after:
            return
        self.near[row, one.begin : one.end], self.sign[row, one.begin : one.end] = sign != 0, sign

    def at(self, z: Array) -> Inside:
        """Reversals of a motion z, shape (node, 2, joint)."""
        joint, cell = (np.array([one[k] for one in self.crossings], dtype=np.intp) for k in (0, 1))
        after, ratio = (np.array([one[k] for one in self.crossings]) for k in (2, 3))
        early = np.maximum(-after * z[cell, 1, joint], 0.0) * ratio
        late = np.maximum(after * z[cell + 1, 1, joint], 0.0)
        total = np.maximum(early + late, CREEP)
        slope = np.stack([-after * ratio * late, -after * early], axis=-1) / (total**2)[:, None]
        return Inside(joint, cell, early / total, slope, self.sign)
