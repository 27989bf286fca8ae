"""Where a search begins: rows of the servo's law, linear in all but delay and rate limit (variable projection)."""

from collections.abc import Sequence
from itertools import product
from typing import final

import numpy as np

from identify.arrays import Array
from identify.servo.run import ServoRun
from identify.servo.servo import Servo
from identify.servo.smooth import CUTOFF, low_passed

DELAYS = np.arange(0.0, 6.1, 0.5)
"""Delays of the command that are tried [samples]."""

RATES = 10
"""Rate limits that are tried, between half and 1.3 times the largest speed of a joint, beside none."""

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
        rates = [np.inf, *(self.fast * np.geomspace(0.5, 1.3, RATES))] if self.fast else [np.inf]
        found = [self.solved(samples, rate) for rate, samples in product(rates, DELAYS)]
        return [p for _, p in sorted((pair for pair in found if pair), key=lambda pair: pair[0])]

    def solved(self, samples: float, rate: float) -> tuple[float, dict[str, float]] | None:
        """Return residual and linear parameters for a delay [samples] and a rate limit [rad/s]; None if they make no servo."""
        parts = [run.rows(self.servo, samples, rate) for run in self._runs]
        W, Y = np.concatenate([w for w, _ in parts]), np.concatenate([y for _, y in parts])
        size = np.sqrt((W**2).sum(axis=0))
        used = size > 0
        X = np.zeros(len(COLUMNS))
        X[used] = np.linalg.lstsq(W[:, used] / size[used], Y, rcond=1e-8)[0] / size[used]
        if X[0] <= 0:
            return None
        p = dict(zip(COLUMNS, X.tolist(), strict=True))
        p |= {"offset": p["offset"] / p["a"], "delay": samples * self._runs[0].T, "rate": rate}
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
        self.q = low_passed(q)
        self.qd, self.qdd = np.gradient(self.q, self.T), np.gradient(np.gradient(self.q, self.T), self.T)
        self._on = np.interp(self._t, run.t, run.enabled.astype(float))
        driven = np.abs(self.qd[self._on > 0])
        self.fast = float(np.quantile(driven, 0.995)) if driven.size else 0.0
        inertia, sine, cosine, rest = (
            np.interp(self._t, run.t, np.broadcast_to(getattr(run.load, x), run.t.shape))
            for x in ("inertia", "sine", "cosine", "rest")
        )
        self.inertia = float(inertia.mean())
        self._needed = inertia * self.qdd + sine * np.sin(self.q) + cosine * np.cos(self.q) + rest

    def rows(self, servo: Servo, samples: float, rate: float) -> tuple[Array, Array]:
        """Return W and Y."""
        run = self.run
        command = np.interp(self._t - samples * self.T, run.t, run.command)
        target = _limited(command, rate * self.T)
        error = target - np.interp(self._t, run.t, run.q)
        g = servo.gain * run.kp
        duty = np.clip(g * error, -servo.duty_limit, servo.duty_limit)
        V = self._on * servo.supply
        inside = np.abs(g * error) < servo.duty_limit
        columns = (V * duty, -self._on * self.qd, -self.qdd, -np.sign(self.qd), V * g * inside)
        W = np.stack([low_passed(column) for column in columns], axis=1)
        decimation = max(1, int(0.25 / CUTOFF))
        return W[::decimation], low_passed(self._needed)[::decimation]


def _limited(command: Array, most: float) -> Array:
    """Return a target that follows a command by at most `most` a sample."""
    if not np.isfinite(most) or np.abs(np.diff(command)).max(initial=0.0) <= most:
        return command
    target = command.copy()
    for i in range(1, len(target)):
        target[i] = target[i - 1] + min(max(command[i] - target[i - 1], -most), most)
    return target
