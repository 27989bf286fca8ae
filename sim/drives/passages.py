"""Passages of windings through PWM periods, tabulated where the duty has few values."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from idbench.sim.drives.loops import Loops, PeriodTable, Windings
from idbench.sim.drives.pwm import Modulator, Pieces, pieces
from idbench.sim.drives.winding import Winding, pass_period, straight
from idbench.sim.robot.motors import Array

MAX_VALUES = 20_000  # Values of the modulation index beyond which no table is made


@dataclass(frozen=True, eq=False)
class ExactPassages:
    """Passages computed period by period, for any modulation index."""

    winding: Winding
    """Shape (sim, joint)."""
    modulator: Modulator
    """Its chopper."""

    least: float = 0.0
    """Step of the modulation index, 0 if it has none."""

    def advance(self, loops: Loops, windings: Windings, wanted: Array, emf: Array) -> Array:
        """Advance windings by PWM periods, in arrays over windings; arguments and what is returned as for `periods`."""
        done = np.empty((4, *emf.shape))
        charge, before, after, index = done
        for k, e in enumerate(emf):
            error = wanted - windings.i
            asked = loops.kp * error + windings.sum + loops.known * e
            v = np.minimum(np.maximum(asked, -loops.most), loops.most)
            windings.sum[:] += loops.ki * error * (v == asked)
            m = v / self.winding.V
            index[k], before[k] = np.rint(m / self.least) * self.least if self.least else m, windings.i
            after[k], charge[k], electrical = pass_period(windings.i, index[k], e, self.winding, self.modulator)
            windings.i[:] = after[k]
            windings.electrical[:] += electrical
        return done


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

    def advance(self, loops: Loops, windings: Windings, wanted: Array, emf: Array) -> Array:
        """Advance windings by PWM periods, as `ExactPassages` does."""
        from idbench.sim.drives.periods import periods  # loads a compiler

        return np.asarray(periods(self._compact, loops, windings, wanted, np.ascontiguousarray(emf)))

    @cached_property
    def highest(self) -> int:
        """Number of the value of the modulation index 1, where that of 0 is 0."""
        return int(np.ceil(1 / self.least))

    @property
    def _values(self) -> int:
        return 2 * self.highest + 1

    @cached_property
    def _compact(self) -> PeriodTable:
        """The table, as compiled code takes it."""
        V, R, L = (np.ascontiguousarray(x[0]) for x in self.winding)
        shape = *self._pieces.duration.shape, len(V)
        kept = np.exp(-self._pieces.duration[..., None] * (R / L))
        each = [np.broadcast_to(x[..., None], shape) for x in self._pieces]
        of_pieces = np.ascontiguousarray(np.stack([*each, kept], axis=-1).swapaxes(0, 1))
        linear = self._table.reshape(2, self._values, len(V), 3, -1)
        return PeriodTable(self.least, self.highest, linear, of_pieces, V, R, L, bool(self.modulator.dead_time))

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
    return ExactPassages(winding, modulator, least)
