"""The delay of a log's torque, from the log alone."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from idbench.identify.arrays import Array
from idbench.identify.basis.basis import Basis
from idbench.identify.data.motion_log import MotionLog, TorqueChannel
from idbench.identify.errors import ExcitationError, LogError, RangeError, SettingError
from idbench.identify.estimators.log_rows import DELAY_STEP
from idbench.identify.estimators.problem import Problem
from idbench.identify.minimum import minimum
from idbench.identify.models import ExplicitModel
from idbench.identify.rows.chain import Chain, idbench_chain
from idbench.identify.rows.rows import Rows, manageable

RANGE = (-0.02, 0.05)
"""Delays [s] of a first look: a filtered measurement is late by some milliseconds, a slow controller by some tens."""

WIDER, FARTHEST = 3.0, 0.6
"""How many times farther each further look goes, and how far at most [s]: two clocks of a recorder may be that far apart."""

SHARE = 0.05
"""Share of a log that a delay may be: its rows must lie inside the log at all delays."""

STEPS = 2
"""Steps of the generalized least squares in which the delay is a parameter."""

ROUNDS, SETTLED = 10, 0.1
"""Steps at most in which each joint's is, and share of a sigma by which the last one may move them: 1 % of sigma^2."""

BLOCKS = 16
"""Stretches of the log of which each is left out once, to see how much the delay depends on it."""

_COARSE = 15
"""Delays of a first look, which brackets the smallest misfit."""


@dataclass(frozen=True)
class DelayEstimate:
    """A delay and how sure it is."""

    delay: float
    """[s], as `TorqueChannel` counts it."""
    sigma: float | tuple[float, ...]
    """Standard deviation [s], or that of each joint's, by the jackknife: from what happens when stretches of the log are left
    out."""
    lags: tuple[float, ...] = ()
    """What each joint is late beyond the delay [s], if each has its own."""

    def of(self, channel: TorqueChannel) -> TorqueChannel:
        """Return a channel with this delay."""
        return replace(channel, delay=self.delay, delay_sigma=self.sigma, lags=self.lags)

    @property
    def doubt(self) -> float:
        """The largest standard deviation [s]."""
        return float(np.max(self.sigma))

    def differs(self, channel: TorqueChannel, least: float) -> bool:
        """Return whether it differs from the delays of a channel by more than `least` [s]."""
        found, stated = (one.delay + np.asarray(one.lags or 0.0) for one in (self, channel))
        return bool((np.abs(found - stated) > least).any())

    @property
    def words(self) -> str:
        """It and its sigma in words."""
        return (
            f"{self.of(TorqueChannel('held')).late}, sigma {', '.join(f'{1e3 * x:.2g}' for x in np.atleast_1d(self.sigma))} ms"
        )


def estimate_delay(
    log: MotionLog | Sequence[MotionLog],
    basis: Basis,
    chain: Chain | None = None,
    within: tuple[float, float] | None = None,
) -> DelayEstimate:
    """Return the delay with which the explicit model explains the torques best.

    A search over delays, by the likelihood of Gaussian noise with a level of its own for each joint, brackets the best one; it
    goes farther as long as that lies at an end. The delay is then a parameter beside the others in generalized least squares:

        [X; delta] = argmin (Y - W X - d delta)' C^-1 (Y - W X - d delta),   d = dY/d(delay)

    Parameters
    ----------
    log : MotionLog or sequence of MotionLog
        One run, or several of one fit; the delay that its torque channel states is not used.
    basis : Basis
        The robot.
    chain : Chain, optional
        Signal processing that reads torques by their channel; chain `idbench` by default.
    within : tuple of float, optional
        Smallest and largest delay to look at [s]; by default -20 to 50 ms, and farther if the best is at an end.

    Raises
    ------
    LogError
        If a log holds several runs, or is too short.
    SettingError
        If the range is empty, the chain does not read the delay, or the best delay lies at an end of the range.
    ExcitationError
        If the motion excites none of the parameters; those that it does not excite count as zero.
    """
    logs = manageable([log] if isinstance(log, MotionLog) else list(log))
    if any(one.q.ndim != 2 for one in logs):
        raise LogError("the delay is estimated from one run, or a sequence of them: give the runs one by one")
    if within is not None and not within[0] < within[1]:
        raise SettingError(f"the range of delays, {within[0]:g} to {within[1]:g} s, is empty")
    chain = chain or idbench_chain()
    low, high = within or RANGE
    farthest = min(FARTHEST, SHARE * min(one.samples / one.fs for one in logs))
    while True:
        try:
            return _Search(logs, basis, chain, (low, high)).run()
        except ExcitationError as error:
            basis = _without_hidden(basis, error)
        except RangeError:
            if within or high >= farthest or not _is_read(logs, chain):
                raise
            low, high = max(WIDER * low, -farthest), min(WIDER * high, farthest)


def estimate_joint_delays(
    log: MotionLog | Sequence[MotionLog],
    basis: Basis,
    chain: Chain | None = None,
    within: tuple[float, float] | None = None,
) -> DelayEstimate:
    """Return the delay of each joint's torque, beside the parameters in generalized least squares.

        [X; delta] = argmin (Y + D delta - W X)' C^-1 (Y + D delta - W X),   D = dY/d(delays), a column a joint

    from the delay that is best for all: torques of joints are logged at different instants where drives answer one after the
    other, or filter by themselves. Model errors that are alike in all joints move a common delay less than these.

    Parameters, errors
        As for `estimate_delay`.

    Raises
    ------
    RangeError
        If the delays do not settle.
    """
    common = estimate_delay(log, basis, chain, within)
    logs = manageable([log] if isinstance(log, MotionLog) else list(log))
    try:
        Problem(tuple(logs), basis, ExplicitModel(), chain or idbench_chain()).rows.factors.together.check()
    except ExcitationError as error:
        basis = _without_hidden(basis, error)
    delays, sigma = np.full(basis.n, common.delay), np.zeros(basis.n)
    for _ in range(ROUNDS):
        mean = float(delays.mean())
        found = DelayEstimate(mean, tuple(sigma.tolist()), tuple((delays - mean).tolist()))
        delayed = [replace(one, torque=found.of(one.torque)) for one in logs]
        problem = Problem(tuple(delayed), basis, ExplicitModel(), chain or idbench_chain())
        steps, whole = _steps_of(problem, each=True)
        shown = np.isfinite(whole)  # not of a joint without torque
        delays, sigma = delays + np.where(shown, whole, 0.0), np.where(shown, _jackknife(steps), 0.0)
        if (np.abs(whole[shown]) < SETTLED * sigma[shown]).all():
            return replace(found, sigma=tuple(sigma.tolist()))
    raise RangeError(
        "the delays of the joints do not settle: does the model fit the robot? `estimate` finds one delay for all joints"
    )


def _without_hidden(basis: Basis, error: ExcitationError) -> Basis:
    """Return the basis without what no torque depends on here, whenever it acts; raise the error if nothing is left."""
    if not error.hidden or len(error.hidden) >= len(basis.names):
        raise error
    return basis.without(*error.hidden)


def nearby_delay(problem: Problem) -> DelayEstimate:
    """Return the delay by one step of generalized least squares from the stated one, near which it must be.

    Parameters
    ----------
    problem : Problem
        Logs with one torque channel, and their rows.
    """
    steps, (whole,) = _steps_of(problem.explicit, each=False)
    return DelayEstimate(problem.logs[0].torque.delay + float(whole), float(_jackknife(steps)[0]))


def _steps_of(problem: Problem, each: bool) -> tuple[Array, Array]:
    """Return steps of the delay, or of each joint's, without each block of rows, and of all: Y + D delta = W X."""
    D = [np.stack(part.delay_slopes(each), axis=-1) for part in problem.parts]
    parts = zip(problem.parts, D, strict=True)
    A = _white(problem, [np.column_stack([part.unbiased.W, -slopes, part.rows.Y]) for part, slopes in parts])
    return _left_out(A[:, :-1], A[:, -1], D[0].shape[-1])


def _is_read(logs: Sequence[MotionLog], chain: Chain) -> bool:
    """Return whether the chain reads the delay of a log at all."""
    late = replace(logs[0], torque=replace(logs[0].torque, delay=1 / logs[0].fs))
    return not np.array_equal(chain.signals(late).torque.mean, chain.signals(logs[0]).torque.mean)


class _Search:
    def __init__(self, logs: list[MotionLog], basis: Basis, chain: Chain, within: tuple[float, float]) -> None:
        self._logs, self._within = logs, within
        halos = [chain.halo(log.fs, replace(log.torque, delay=delay)) for log in logs for delay in within]
        # The same rows at all delays, or their misfits could not be compared.
        self._chain = replace(chain, trim=max(*halos, chain.trim or 0.0))
        self._problem = Problem(tuple(logs), basis, ExplicitModel(), self._chain)
        self._rows = self._problem.rows

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
        low, high = float(grid[best - 1]), float(grid[best + 1])
        return self._refined(minimum(self._misfit, low, high, 1e-7), (low, high))

    def _refined(self, delay: float, within: tuple[float, float]) -> DelayEstimate:
        """Return the delay as a parameter, delta(k+1) = delta(k) + its GLS step, and its jackknife's standard deviation.

        Rows are weighted by the noise at the delay of the search: at the stated one, what is late would count as noise. If the
        steps leave the bracket of the search, which they do where the model is far off, it is the search's.
        """
        self._problem = replace(self._problem, logs=self._delayed(delay))
        found, W = delay, _white(self._problem, [part.unbiased.W for part in self._problem.parts])
        for _ in range(STEPS):
            steps, (whole,) = self._step(found, W)
            if not within[0] <= found + whole <= within[1]:
                return DelayEstimate(delay, float(_jackknife(self._step(delay, W)[0])[0]))
            found += whole
        return DelayEstimate(float(found), float(_jackknife(steps)[0]))

    def _step(self, delay: float, W: Array) -> tuple[Array, Array]:
        """Return the step of the delay without each block, and of all: Y(delay + delta) = Y + d delta = W X."""
        Y, slope = self._at(delay).Y, (self._at(delay + DELAY_STEP).Y - self._at(delay - DELAY_STEP).Y) / (2 * DELAY_STEP)
        ends = np.cumsum([len(part.rows.time) for part in self._problem.parts])[:-1]
        last = _white(self._problem, np.split(np.stack([-slope, Y], axis=1), ends))
        return _left_out(np.concatenate([W, last[:, :1]], axis=1), last[:, 1], 1)

    def _at(self, delay: float) -> Rows:
        """Return the rows at a delay, of which Y alone depends on it."""
        parts = zip(self._rows.maps, self._delayed(delay), strict=True)
        return replace(
            self._rows, Y=np.concatenate([rows.measurement(self._chain.signals(log).torque.mean) for rows, log in parts])
        )

    def _delayed(self, delay: float) -> tuple[MotionLog, ...]:
        return tuple(replace(log, torque=replace(log.torque, delay=delay, lags=())) for log in self._logs)

    def _misfit(self, delay: float) -> float:
        return float(self._at(delay).factors.misfit())


def _white(problem: Problem, each: Sequence[Array]) -> Array:
    """Return columns of the rows of each log, made independent, of the rows that are not void."""
    parts = zip(problem.parts, each, strict=True)
    return np.concatenate([part.whitening.whiten(x)[part.rows.valid] for part, x in parts])


def _jackknife(steps: Array) -> Array:
    """Return the standard deviations of what is estimated with each block left out, shape (block, k)."""
    return np.asarray(np.sqrt((BLOCKS - 1) / BLOCKS * np.sum((steps - steps.mean(axis=0)) ** 2, axis=0)))


def _left_out(A: Array, y: Array, last: int) -> tuple[Array, Array]:
    """Return the `last` unknowns of A x = y, by least squares, with each block of rows left out, and of all rows."""
    block, scale = np.arange(len(A)) * BLOCKS // len(A), np.linalg.norm(A, axis=0)
    A = A / np.where(scale > 0, scale, 1.0)
    squares = np.array([A[block == b].T @ A[block == b] for b in range(BLOCKS)])
    products = np.array([A[block == b].T @ y[block == b] for b in range(BLOCKS)])
    left = np.concatenate([squares.sum(axis=0) - squares, squares.sum(axis=0, keepdims=True)])
    x = (
        np.linalg.pinv(left, hermitian=True)
        @ np.concatenate([products.sum(axis=0) - products, products.sum(axis=0, keepdims=True)])[..., None]
    )
    found = x[:, -last:, 0] / np.where(scale[-last:] > 0, scale[-last:], np.nan)
    return found[:-1], found[-1]
