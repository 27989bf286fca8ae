"""PWM periods of windings behind their current loops, one after the other, as compiled code."""

import math

import numpy as np

from idbench.identify.compiled import compiled
from idbench.sim.drives.winding import Loops, PeriodTable, Windings
from idbench.sim.robot.motors import Array


@compiled
def _over_zero(i: float, goal: float, dt: float, onward: float, rate: float) -> tuple[float, float]:
    """Return for how long [s] of a piece the current is zero or beyond, and where it ends: zero, or where e drives it on."""
    until = math.log(1 - i / goal) / rate if goal != 0.0 and i != 0.0 else 0.0
    rest = dt - min(until, dt)
    return rest, -onward * math.expm1(-rest * rate)


@compiled
def _careful(i: float, pieces: Array, e: float, V: float, R: float, L: float) -> tuple[float, float]:
    """Return the passage of a current that may change its sign: current [A] and charge [A s]."""
    total = 0.0
    share, rate = L / R, R / L
    for k in range(len(pieces)):
        dt, forward, backward, kept = pieces[k]
        ahead, behind = (forward * V - e) / R, (backward * V - e) / R
        goal = ahead if ahead == behind or i > 0.0 else behind
        end = goal + (i - goal) * kept
        if ahead != behind and i * end <= 0.0:
            onward = max(ahead, 0.0) + min(behind, 0.0)
            rest, end = _over_zero(i, goal, dt, onward, rate)
            total += goal * (dt - rest) + (i - 0.0) * share
            i = 0.0
            goal, dt = onward, rest
        total += goal * dt + (i - end) * share
        i = end
    return i, total


@compiled
def _passage(table: PeriodTable, joint: int, i: float, value: int, e: float) -> tuple[float, float]:
    """Return current [A] and charge [A s] of a period: constant + by_i i + by_e e, while i keeps its sign."""
    found = table.linear[1 if i > 0.0 else 0, value, joint]
    last = found.shape[1] - 1
    now = 0.0
    for edge in range(1, last + 1):
        now = found[0, edge] + found[1, edge] * i + found[2, edge] * e
        if table.has_dead_time and now * i <= 0.0:
            return _careful(i, table.pieces[value, :, joint], e, table.V[joint], table.R[joint], table.L[joint])
    return now, found[0, 0] + found[1, 0] * i + found[2, 0] * e


@compiled
def periods(table: PeriodTable, loops: Loops, windings: Windings, wanted: Array, emf: Array) -> Array:
    """Advance windings by PWM periods.

    In each, v = kp (i_ref - i) + sum + known e within its limit; the integrator rests while v is at it.

    Parameters
    ----------
    table, loops, windings
        The windings, their loops, and their state.
    wanted : Array, shape (sim, joint)
        Current references [A].
    emf : Array, shape (period, sim, joint)
        Back-EMF [V].

    Returns
    -------
    Array, shape (4, period, sim, joint)
        Charge [A s], currents before and after [A], and modulation index.
    """
    done = np.empty((4, *emf.shape))
    for sim in range(wanted.shape[0]):
        for joint in range(wanted.shape[1]):
            kp, ki = loops.kp[sim, joint], loops.ki[sim, joint]
            most = loops.most[sim, joint]
            i, total = windings.i[sim, joint], windings.sum[sim, joint]
            for k in range(len(emf)):
                e = emf[k, sim, joint]
                error = wanted[sim, joint] - i
                asked = kp * error + total + loops.known * e
                v = min(max(asked, -most), most)
                if v == asked:
                    total += ki * error
                steps = np.rint(v / table.V[joint] / table.least)
                done[1, k, sim, joint] = i
                done[3, k, sim, joint] = steps * table.least
                if math.isfinite(asked) and math.isfinite(e):
                    i, charge = _passage(table, joint, i, int(steps) + table.highest, e)
                else:  # the simulation then fails, and says so
                    i = charge = math.nan
                done[0, k, sim, joint] = charge
                done[2, k, sim, joint] = i
            windings.i[sim, joint], windings.sum[sim, joint] = i, total
    return done
