"""Where a search begins: rows of the servo's law, linear in all but delay and rate limit (variable projection)."""

from collections.abc import Sequence
from typing import final

import numpy as np

from identify.arrays import Array
from identify.servo.run import ServoRun
from identify.servo.servo import Servo
from identify.servo.smooth import CUTOFF, low_passed

DELAYS = np.array([*np.arange(0.0, 0.0601, 0.005), 0.08, 0.1, 0.13, 0.16, 0.2, 0.25])
"""Delays of the command that are tried [s]."""

RATES = 10
"""Rate limits that are tried, between half and 1.3 times the largest speed of a joint, beside none."""

DECIMATION = max(1, int(0.25 / CUTOFF))

COLUMNS = ("a", "b", "Ia", "Fs", "offset")


@final
class ServoRows:
    """Rows of runs on one clock each: J qdd + load = a V duty - b qd - Fs sign(qd) - Ia qdd + a V g kp offset.

    Parameters
    ----------
    servo : Servo
        What is known.
    runs : sequence of ServoRun
        What was logged.
    """

    def __init__(self, servo: Servo, runs: Sequence[ServoRun]) -> None:
        self.servo, self._runs = servo, [_Uniform(run) for run in runs]
        self.fast = max(run.fast for run in self._runs)

    def starts(self) -> list[dict[str, float]]:
        """Return parameters for each delay and rate limit that is tried, those whose rows fit best first."""
        rates = np.array([np.inf, *(self.fast * np.geomspace(0.5, 1.3, RATES))] if self.fast else [np.inf])
        targets = [run.targets(rates) for run in self._runs]
        found = [
            self.solved(float(delay), rate, [t[:, k] for t in targets]) for k, rate in enumerate(rates) for delay in DELAYS
        ]
        return [p for _, p in sorted((pair for pair in found if pair), key=lambda pair: pair[0])]

    def solved(self, delay: float, rate: float, targets: Sequence[Array]) -> tuple[float, dict[str, float]] | None:
        """Return residual and linear parameters for a delay [s] and targets within a rate; None if they make no servo."""
        parts = [run.rows(self.servo, delay, target) for run, target in zip(self._runs, targets, strict=True)]
        W, Y = np.concatenate([w for w, _ in parts]), np.concatenate([y for _, y in parts])
        size = np.sqrt((W**2).sum(axis=0))
        used = size > 0
        X = np.zeros(len(COLUMNS))
        X[used] = np.linalg.lstsq(W[:, used] / size[used], Y, rcond=1e-8)[0] / size[used]
        if X[0] <= 0:
            return None
        p = dict(zip(COLUMNS, X.tolist(), strict=True))
        p |= {"offset": p["offset"] / p["a"], "delay": delay, "rate": float(rate)}
        p["b"] = max(p["b"], 0.02 * p["a"])
        p["Ia"] = max(p["Ia"], 0.02 * self._runs[0].inertia)
        p["Fs"] = max(p["Fs"], 0.0)
        return float(np.mean((Y - W @ X) ** 2)), p


@final
class _Uniform:
    """A run on a uniform clock, low-passed."""

    def __init__(self, run: ServoRun) -> None:
        self.run, self.T = run, run.T
        self._t = np.arange(run.t[0], run.t[-1], self.T)
        q = np.interp(self._t, run.t, run.q)
        self.q, self._measured = low_passed(q), q
        qd = np.gradient(self.q, self.T)
        qdd = np.gradient(qd, self.T)
        self._on = np.interp(self._t, run.t, run.enabled.astype(float))
        driven = np.abs(qd[self._on > 0])
        self.fast = float(np.quantile(driven, 0.995)) if driven.size else 0.0
        inertia, sine, cosine, rest = (
            np.interp(self._t, run.t, np.broadcast_to(getattr(run.load, x), run.t.shape))
            for x in ("inertia", "sine", "cosine", "rest")
        )
        self.inertia = float(inertia.mean())
        needed = inertia * qdd + sine * np.sin(self.q) + cosine * np.cos(self.q) + rest
        columns = np.stack([-self._on * qd, -qdd, -np.sign(qd), needed], axis=1)
        *motion, self._needed = low_passed(columns)[::DECIMATION].T
        self._motion = np.stack(motion, axis=1)

    def targets(self, rates: Array) -> Array:
        """Return the command within rates [rad/s], not yet late, shape (time, rate)."""
        run = self.run
        return _limited(np.interp(self._t, run.t, run.command), rates * self.T)

    def rows(self, servo: Servo, delay: float, target: Array) -> tuple[Array, Array]:
        """Return W and Y for a target that is late [s]."""
        run = self.run
        late = np.interp(self._t - delay, self._t, target)
        error = late - self._measured
        g = servo.gain * run.kp
        duty = np.clip(g * error, -servo.duty_limit, servo.duty_limit)
        V = self._on * servo.supply
        inside = np.abs(g * error) < servo.duty_limit
        driven = low_passed(np.stack([V * duty, V * g * inside], axis=1))[::DECIMATION]
        return np.concatenate([driven[:, :1], self._motion, driven[:, 1:]], axis=1), self._needed


def _limited(command: Array, most: Array) -> Array:
    """Return targets that follow a command by at most `most` a sample, shape (time, most)."""
    if len(command) < 2:
        return np.repeat(command[:, None], len(most), axis=1)
    target = np.empty((len(command), len(most)))
    now = target[0] = command[0]
    for i, wanted in enumerate(command[1:].tolist(), start=1):
        now = target[i] = now + np.minimum(np.maximum(wanted - now, -most), most)
    return target
