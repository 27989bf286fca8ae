"""Where a search begins: rows of the servo's law, linear in all but delay and rate limit (variable projection)."""

from collections.abc import Mapping, Sequence
from functools import cache

import numpy as np
import scipy

from idbench.identify.arrays import Array
from idbench.identify.servo.closed_loop import targets
from idbench.identify.servo.run import ServoRun
from idbench.identify.signals.filters import forward_backward

CUTOFF = 1 / 12  # Cut-off of the low-pass, as a share of the sampling frequency: motion lies below, differentiated counts above

DRIFT_CUTOFF = CUTOFF / 2
"""Cut-off of the residuals that correct a simulated motion, as a share of the sampling frequency.

Chosen on an arm of six whose servos were known exactly, to 3 % and to 10 %. Torques of the
joints were then off by 3, 9 and 30 mN m; by 4, 13 and 54 uncorrected, by 21 where positions were only measured."""


def low_passed(x: Array, cutoff: float = CUTOFF) -> Array:
    """Signals of a uniform clock, shape (time, ...), without what lies above the cut-off; none is late."""
    return np.moveaxis(forward_backward(_sections(cutoff), np.moveaxis(x, 0, -1)), -1, 0)


@cache
def _sections(cutoff: float) -> Array:
    return np.asarray(scipy.signal.butter(2, 2 * cutoff, output="sos"))


def smoothed(t: Array, q: Array, cutoff: float = CUTOFF) -> tuple[Array, Array, Array]:
    """Smoothed positions, velocities and accelerations at the times of a log, shape (time, joint)."""
    T = float(np.median(np.diff(t)))
    clock = np.arange(t[0], t[-1] + T / 2, T)
    uniform = low_passed(np.stack([np.interp(clock, t, x) for x in q.T], axis=1), cutoff)
    qd = np.gradient(uniform, T, axis=0)
    motion = (uniform, qd, np.gradient(qd, T, axis=0))
    smooth, speed, acceleration = (np.stack([np.interp(t, clock, y) for y in x.T], axis=1) for x in motion)
    return smooth, speed, acceleration


def corrected(fine: Array, simulated: Array, t: Array, measured: Array) -> tuple[Array, Array, Array]:
    """Positions, velocities and accelerations of a simulated motion, corrected by the measured one, shape (fine,).

    Simulated positions are at fine times, measured ones at those of a log. The residual is added below `DRIFT_CUTOFF`. Jolts,
    which encoder counts hide, come from the simulation, drift from neither.
    """
    steps = np.diff(fine)
    acceleration = np.diff(np.diff(simulated) / steps) / ((steps[1:] + steps[:-1]) / 2)
    motion = (simulated, np.gradient(simulated, fine), np.pad(acceleration, 1, mode="edge"))
    lacking = smoothed(t, (measured - np.interp(t, fine, simulated))[:, None], DRIFT_CUTOFF)
    q, qd, qdd = (x + np.interp(fine, t, y[:, 0]) for x, y in zip(motion, lacking, strict=True))
    return q, qd, qdd


DELAYS = np.array([*np.arange(0.0, 0.0601, 0.005), 0.08, 0.1, 0.13, 0.16, 0.2, 0.25])
"""Delays of the command that are tried [s]."""

RATES = 10  # Rate limits that are tried, between half and 1.3 times the largest speed of a joint, beside none
DECIMATION = max(1, int(0.25 / CUTOFF))  # rows at twice the rate that the band of the smoothing needs
LIGHTEST = 1e-6  # Inertia of a rotor of which rows show none, per torque: a search in shares of it could not leave zero

COLUMNS = ("a", "b", "Ia", "Fs", "offset")


class ServoRows:
    """Rows of runs on one clock each: J qdd + load = a V duty - b qd - Fs sign(qd) - Ia qdd + a V g kp offset."""

    def __init__(self, runs: Sequence[ServoRun], held: Mapping[str, float]) -> None:
        own = [name for name in COLUMNS[:-1] if name != "b" or "Fv" in held]  # the column of b has all damping
        self._held = {COLUMNS.index(name): held[name] + (held["Fv"] if name == "b" else 0.0) for name in own if name in held}
        self._known = dict(held)
        self._runs = [_Uniform(run) for run in runs]
        self.fast = max(run.fast for run in self._runs)

    def starts(self) -> list[dict[str, float]]:
        """Parameters for each delay and rate limit that is tried, those whose rows fit best first."""
        limited = self.fast and any(run.run.servo.kind == "duty" for run in self._runs)
        rates = [np.inf, *(self.fast * np.geomspace(0.5, 1.3, RATES)).tolist()] if limited else [np.inf]
        found = [pair for rate in rates for pair in self._of_rate(rate)]
        return [p for _, p in sorted(found, key=lambda pair: pair[0])]

    def _of_rate(self, rate: float) -> list[tuple[float, dict[str, float]]]:
        """Residual and parameters for each delay, targets keeping within a rate [rad/s]."""
        driven = np.concatenate([run.driven(rate) for run in self._runs])
        motion, Y = (np.concatenate(x) for x in zip(*[run.motion for run in self._runs], strict=True))
        every = (np.concatenate([driven[:, k, :1], motion, driven[:, k, 1:]], axis=1) for k in range(len(DELAYS)))
        found = (self._solved(W, Y, delay, rate) for W, delay in zip(every, DELAYS.tolist(), strict=True))
        return [pair for pair in found if pair]

    def _solved(self, W: Array, Y: Array, delay: float, rate: float) -> tuple[float, dict[str, float]] | None:
        """Residual and linear parameters; None if they make no servo."""
        size = np.sqrt((W**2).sum(axis=0))
        X, used = np.zeros(len(COLUMNS)), size > 0
        for column, value in self._held.items():
            X[column], used[column] = value, False
        X[used] = np.linalg.lstsq(W[:, used] / size[used], Y - W @ X, rcond=1e-8)[0] / size[used]
        if X[0] <= 0:
            return None
        p = dict(zip(COLUMNS, X.tolist(), strict=True))
        p |= {"offset": p["offset"] / p["a"], "delay": delay, "rate": float(rate)}
        known, least = self._known.get("b"), 0.02 * p["a"] * self._runs[0].run.servo.supply
        p["b"], p["Fv"] = (max(p["b"], least), 0.0) if known is None else (known, max(p["b"] - known, 0.0))
        # Rotors that stop within half a sample look like none; a search could not leave that.
        p["Ia"] = max(p["Ia"], 0.02 * self._runs[0].inertia, p["b"] * self._runs[0].T / 2, LIGHTEST * p["a"])
        p["Fs"] = max(p["Fs"], 0.0)
        return float(np.mean((Y - W @ X) ** 2)), p


class _Uniform:
    """A run on a uniform clock, low-passed."""

    def __init__(self, run: ServoRun) -> None:
        self.run, self.T = run, run.T
        self._t = np.arange(run.t[0], run.t[-1], self.T)
        q = np.interp(self._t, run.t, run.clean)
        self.q, self._measured = low_passed(q), q
        self._speed = qd = np.gradient(self.q, self.T)
        qdd = np.gradient(qd, self.T)
        self._on = np.interp(self._t, run.t, run.enabled.astype(float))
        driven = np.abs(qd[self._on > 0])
        self.fast = float(np.quantile(driven, 0.995)) if driven.size else 0.0
        inertia, sine, cosine, rest, *_ = run.load.over(self._t)
        self.inertia = float(inertia.mean())
        needed = inertia * qdd + sine * np.sin(self.q) + cosine * np.cos(self.q) + rest
        filtered = low_passed(np.stack([-self._on * qd, -qdd, -np.sign(qd), needed], axis=1))[::DECIMATION]
        self.motion = filtered[:, :-1], filtered[:, -1]

    def driven(self, rate: float) -> Array:
        """Columns of a and of the offset for each delay, shape (time, delay, 2)."""
        run, servo = self.run, self.run.servo
        target = targets(np.interp(self._t, run.t, run.command), rate, self.T)
        late = np.interp(self._t[:, None] - DELAYS, self._t, target)
        duty = servo.slope * (late - self._measured[:, None]) - servo.kd * self._speed[:, None]
        if run.forward is not None:
            duty += np.interp(self._t[:, None] - DELAYS, self._t, np.interp(self._t, run.t, run.forward))
        inside = np.abs(duty) < servo.limit
        V = (self._on * servo.supply)[:, None]
        limited = np.clip(duty, -servo.limit, servo.limit)
        return low_passed(np.stack([V * limited, V * servo.slope * inside], axis=2))[::DECIMATION]
