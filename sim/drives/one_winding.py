"""One current-controlled winding at a time, in Python's own numbers: of few windings, arrays cost more than what they hold."""

from typing import NamedTuple

import numpy as np

from idbench.sim.drives.passages import TabulatedPassages


class Loop(NamedTuple):
    """A sampled PI current loop with feedforward of the back-EMF, of one winding."""

    kp: float
    """Proportional gain [V/A]."""
    ki: float
    """Integral gain, times the sampling period [V/A]."""
    most: float
    """Largest voltage that it asks for [V]."""
    known: float
    """Share of the back-EMF that it feeds forward."""


class Periods(NamedTuple):
    """What a winding did in PWM periods: a number a period each."""

    charge: list[float]
    before: list[float]
    after: list[float]
    m: list[float]


class OneWinding:
    """A winding and its loop at work; the arithmetic is that of arrays of windings, in the same order: the same bits.

    Parameters
    ----------
    passages : TabulatedPassages
        Where its table is.
    joint : int
        Which of the joints it drives.
    loop : Loop
        Its current loop.
    """

    def __init__(self, passages: TabulatedPassages, joint: int, loop: Loop) -> None:
        self._loop = loop
        self._least = passages.least
        self._highest = passages.highest
        self._V, self._R, self._L = (float(x[0, joint]) for x in passages.winding)
        self._rate, self._share = self._R / self._L, self._L / self._R
        self._rows = passages.rows(joint)
        self._pieces = passages.pieces_of(joint)
        self._has_dead_time = bool(passages.modulator.dead_time)
        self.i = self.sum = self.electrical = 0.0

    def advance(self, wanted: float, emf: list[float]) -> Periods:
        """Advance by a PWM period for each back-EMF [V], with `wanted` as current reference [A]."""
        (kp, ki, most, known) = self._loop
        V = self._V
        least = self._least
        i = self.i
        done = Periods([], [], [], [])
        for e in emf:
            error = wanted - i
            asked = kp * error + self.sum + known * e
            v = min(max(asked, -most), most)
            if v == asked:
                self.sum += ki * error
            value = round(v / V / least)
            done.before.append(i)
            done.m.append(value * least)
            after, charge, electrical = self._passage(i, value + self._highest, e)
            self.electrical += electrical
            done.charge.append(charge)
            done.after.append(after)
            i = after
        self.i = i
        return done

    def _passage(self, i: float, value: int, e: float) -> tuple[float, float, float]:
        constant, by_i, by_e = self._rows[i > 0][value]
        quantities = [c + a * i + b * e for c, a, b in zip(constant, by_i, by_e, strict=True)]
        if self._has_dead_time:
            edges = quantities[2:]
            if min(edges) <= 0 if i > 0 else i == 0 or max(edges) >= 0:
                return self._careful(i, value, e)
        return quantities[-1], quantities[0], quantities[1]

    def _careful(self, i: float, value: int, e: float) -> tuple[float, float, float]:
        """Return the passage of a current that may change its sign."""
        V, R = self._V, self._R
        total = electrical = 0.0
        for dt, forward, backward, kept in self._pieces[value]:
            ahead, behind = (forward * V - e) / R, (backward * V - e) / R
            goal = ahead if ahead == behind or i > 0 else behind
            end = goal + (i - goal) * kept
            if ahead != behind and i * end <= 0:
                stretches = self._over_zero(i, goal, dt, max(ahead, 0.0) + min(behind, 0.0))
            else:
                stretches = [(i, end, goal, dt)]
            for start, stop, towards, time in stretches:
                charge = towards * time + (start - stop) * self._share
                total += charge
                electrical += (towards * R + e) * charge
            i = stretches[-1][1]
        return i, total, electrical

    def _over_zero(self, i: float, goal: float, dt: float, onward: float) -> list[tuple[float, float, float, float]]:
        """Return the stretch up to the instant at which the current is zero and the one after it."""
        until = float(np.log(1 - i / goal)) / self._rate if goal != 0 and i != 0 else 0.0
        rest = dt - min(until, dt)
        end = -onward * float(np.expm1(-rest * self._rate))
        return [(i, 0.0, goal, dt - rest), (0.0, end, onward, rest)]
