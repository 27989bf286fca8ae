"""The delay of a log's torque, from the log alone."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt
import scipy

from idbench.identify.arrays import TINY, Array
from idbench.identify.basis.basis import Basis
from idbench.identify.data.motion_log import MotionLog
from idbench.identify.errors import LogError, RangeError, SettingError
from idbench.identify.estimators.problem import Problem
from idbench.identify.models import ExplicitModel
from idbench.identify.rows.chain import Chain, idbench_chain
from idbench.identify.rows.rows import Rows, manageable

RANGE = (-0.02, 0.05)
"""Delays [s] that are looked at: a filtered measurement is late by some milliseconds, a slow controller by some tens."""

BLOCKS = 16
"""Stretches of the log of which each is left out once, to see how much the delay depends on it."""

_COARSE = 15
"""Delays of a first look, which brackets the smallest misfit."""


@dataclass(frozen=True)
class DelayEstimate:
    """A delay and how sure it is."""

    delay: float
    """[s], as `TorqueChannel` counts it."""
    sigma: float
    """Standard deviation [s], by the jackknife: from what happens when stretches of the log are left out."""


def estimate_delay(
    log: MotionLog | Sequence[MotionLog],
    basis: Basis,
    chain: Chain | None = None,
    within: tuple[float, float] = RANGE,
) -> DelayEstimate:
    """Return the delay with which the explicit model explains the torques best.

    The misfit is the likelihood of Gaussian noise with a level of its own for each joint, its parameters those that fit best
    at each delay.

    Parameters
    ----------
    log : MotionLog or sequence of MotionLog
        One run, or several of one fit; the delay that its torque channel states is not used.
    basis : Basis
        The robot.
    chain : Chain, optional
        Signal processing that reads torques by their channel; chain `idbench` by default.
    within : tuple of float
        Smallest and largest delay to look at [s].

    Raises
    ------
    LogError
        If a log holds several runs, or is too short.
    SettingError
        If the range is empty, the chain does not read the delay, or the best delay lies at an end of the range.
    ExcitationError
        If the motion does not excite the parameters.
    """
    logs = manageable([log] if isinstance(log, MotionLog) else list(log))
    if any(one.q.ndim != 2 for one in logs):
        raise LogError("the delay is estimated from one run, or a sequence of them: give the runs one by one")
    if not within[0] < within[1]:
        raise SettingError(f"the range of delays, {within[0]:g} to {within[1]:g} s, is empty")
    search = _Search(logs, basis, chain or idbench_chain(), within)
    return search.run()


class _Search:
    def __init__(self, logs: list[MotionLog], basis: Basis, chain: Chain, within: tuple[float, float]) -> None:
        self._logs, self._within = logs, within
        halos = [chain.halo(log.fs, replace(log.torque, delay=delay)) for log in logs for delay in within]
        # The same rows at all delays, or their misfits could not be compared.
        self._chain = replace(chain, trim=max(*halos, chain.trim or 0.0))
        self._rows = Problem(tuple(logs), basis, ExplicitModel(), self._chain).rows

    def run(self) -> DelayEstimate:
        low, high = self._within
        self._rows.factors.together.check()
        grid = np.linspace(low, high, _COARSE)
        best = int(np.argmin([self._misfit(float(delay)) for delay in grid]))
        if best in (0, _COARSE - 1):
            raise RangeError(
                f"the torque fits best at an end of the range, {grid[best]:g} s: look further, or give the delay; "
                "a chain that takes torques as logged does not read it at all"
            )
        found = scipy.optimize.minimize_scalar(
            self._misfit, bounds=(grid[best - 1], grid[best + 1]), method="bounded", options={"xatol": 1e-7}
        )
        return DelayEstimate(float(found.x), self._sigma(float(found.x)))

    def _at(self, delay: float) -> Rows:
        """Return the rows at a delay, of which Y alone depends on it."""
        channels = [replace(log.torque, delay=delay) for log in self._logs]
        delayed = [replace(log, torque=channel) for log, channel in zip(self._logs, channels, strict=True)]
        parts = zip(self._rows.maps, delayed, strict=True)
        return replace(
            self._rows, Y=np.concatenate([rows.measurement(self._chain.signals(log).torque.mean) for rows, log in parts])
        )

    def _misfit(self, delay: float) -> float:
        factors = self._at(delay).factors
        return float(np.sum(factors.rows * np.log(np.maximum(factors.squares(factors.fit(2).X), TINY))))

    def _sigma(self, delay: float) -> float:
        """Return the jackknife's standard deviation of a Gauss-Newton step from the optimum, blocks of time left out."""
        step, rows = 1e-4, self._at(delay)
        slope = (self._at(delay + step).Y - self._at(delay - step).Y) / (2 * step)
        fit = rows.factors.fit(2)
        weight = np.tile(fit.weight, len(rows.time) // rows.kinds)
        A = np.concatenate([rows.W, -slope[:, None]], axis=1) * weight[:, None]
        counted = np.cumsum(rows.valid) - 1
        steps = _left_out(A, weight * (rows.Y - rows.predicted(fit.X)), counted * BLOCKS // (counted[-1] + 1))
        return float(np.sqrt((BLOCKS - 1) / BLOCKS * np.sum((steps - steps.mean()) ** 2)))


def _left_out(A: Array, y: Array, block: npt.NDArray[np.signedinteger]) -> Array:
    """Return the last unknown of A x = y, by least squares, with each block of rows left out."""
    scale = np.linalg.norm(A, axis=0)
    A = A / scale
    squares = np.array([A[block == b].T @ A[block == b] for b in range(BLOCKS)])
    products = np.array([A[block == b].T @ y[block == b] for b in range(BLOCKS)])
    x = np.linalg.pinv(squares.sum(axis=0) - squares, hermitian=True) @ (products.sum(axis=0) - products)[..., None]
    return x[:, -1, 0] / scale[-1]
