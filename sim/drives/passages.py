"""Passages of windings through PWM periods, tabulated where the duty has few values."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from idbench.sim.drives.pwm import Modulator, Pieces, pieces
from idbench.sim.drives.winding import Passage, Winding, pass_period, step_by_step, straight
from idbench.sim.robot.motors import Array

MAX_VALUES = 20_000
"""Values of the modulation index beyond which no table is made."""


@dataclass(frozen=True, eq=False)
class ExactPassages:
    """Passages computed period by period, for any modulation index."""

    winding: Winding
    """Shape (sim, joint)."""
    modulator: Modulator
    """Its chopper."""

    def through(self, i: Array, m: Array, e: Array) -> Passage:
        """Return the passage of currents `i` [A] at modulation index `m` and back-EMF `e` [V], all of shape (sim, joint)."""
        return pass_period(i, m, e, self.winding, self.modulator)


@dataclass(frozen=True, eq=False)
class TabulatedPassages:
    """The same passages, from a table: while a current keeps its sign, all that a period does is linear in it and in the EMF.

    The modulation index is a multiple of `least`, so that few linear functions occur; their coefficients come from three
    passages each.
    """

    winding: Winding
    """Shape (sim, joint), the same for all simulations."""
    modulator: Modulator
    """Its chopper."""
    least: float
    """Step of the modulation index."""

    def through(self, i: Array, m: Array, e: Array) -> Passage:
        """Return the passage of currents `i` [A] at modulation index `m` and back-EMF `e` [V], all of shape (sim, joint)."""
        n = i.shape[-1]
        value = np.rint(m / self.least).astype(np.intp) + self.highest
        at = ((i > 0) * self._values + value) * n + np.arange(n)
        found = np.take(self._table, at, axis=0)
        quantities = found[..., 0, :] + found[..., 1, :] * i[..., None] + found[..., 2, :] * e[..., None]
        charge = quantities[..., 0]
        electrical = quantities[..., 1]
        edges = quantities[..., 2:]
        passage = Passage(edges[..., -1].copy(), charge, electrical)
        if self.modulator.dead_time:
            turning = (edges * i[..., None] <= 0).any(axis=-1)
            if turning.any():
                some = Winding(*(x[turning] for x in self.winding))
                careful = step_by_step(i[turning], e[turning], some, Pieces(*(x[:, value[turning]] for x in self._pieces)))
                for whole, part in zip(passage, careful, strict=True):
                    whole[turning] = part
        return passage

    @cached_property
    def highest(self) -> int:
        """Number of the value of the modulation index 1, where that of 0 is 0."""
        return int(np.ceil(1 / self.least))

    @property
    def _values(self) -> int:
        return 2 * self.highest + 1

    def rows(self, joint: int) -> tuple[list[list[list[float]]], ...]:
        """Return the table of one joint, for a current that is not positive and one that is: value -> three rows."""
        n = self.winding.V.shape[-1]
        table = self._table.reshape(2, self._values, n, 3, -1)
        return tuple(of_sign[:, joint].tolist() for of_sign in table)

    def pieces_of(self, joint: int) -> list[list[tuple[float, ...]]]:
        """Return, for each value, its pieces: duration, voltages ahead and behind, and what is kept of the current."""
        _, R, L = (x[0, joint] for x in self.winding)
        kept = np.exp(-self._pieces.duration * (R / L))
        return [
            [tuple(piece) for piece in of_value]
            for of_value in np.stack([*self._pieces, kept], axis=-1).swapaxes(0, 1).tolist()
        ]

    @cached_property
    def _indices(self) -> Array:
        """Every value of the modulation index."""
        return np.arange(-self.highest, self.highest + 1, dtype=np.float64) * self.least

    @cached_property
    def _pieces(self) -> Pieces:
        return pieces(self.modulator, self._indices)

    @cached_property
    def _table(self) -> Array:
        """Charge, electrical energy and the currents at edges, (sign, value, joint) -> (constant, by i, by e) x quantity."""
        V: Array = self.winding.V[0]
        shape = 2, self._values, len(V)
        winding = Winding(*(np.broadcast_to(x[0], shape) for x in self.winding))
        m = np.broadcast_to(self._indices[:, None], shape)
        pattern = self.modulator.pattern(m, np.broadcast_to(np.array([0.0, 1.0])[:, None, None], shape))
        made = []
        for i, e in ((0.0, 0.0), (1.0, 0.0), (0.0, 1.0)):
            passage, edges = straight(np.full(shape, i), np.full(shape, e), winding, pattern, self.modulator.period)
            made.append(np.stack([passage.charge, passage.electrical, *edges], axis=-1))
        constant, by_i, by_e = (np.asarray(each, dtype=np.float64) for each in made)
        table: Array = np.array([constant, by_i - constant, by_e - constant])
        return np.moveaxis(table, 0, -2).reshape(-1, 3, constant.shape[-1])


def passages(winding: Winding, modulator: Modulator, least: float) -> ExactPassages | TabulatedPassages:
    """Return the passages of windings; `least` is the step of the modulation index, 0 if it has none."""
    if least and 2 / least < MAX_VALUES:
        return TabulatedPassages(winding, modulator, least)
    return ExactPassages(winding, modulator)
