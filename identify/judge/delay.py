"""The delay of a log's torque, from the log alone."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy

from idbench.identify.arrays import Array
from idbench.identify.basis.basis import Basis
from idbench.identify.data.motion_log import MotionLog, TorqueChannel
from idbench.identify.errors import ExcitationError, LogError, RangeError, SettingError
from idbench.identify.estimators.leave_out import scatter
from idbench.identify.estimators.problem import Problem
from idbench.identify.iterate import minimum, not_converged
from idbench.identify.judge.delay_step import ROUNDS, SETTLED, delay_step, newton
from idbench.identify.models import ExplicitModel
from idbench.identify.rows.chain import Chain, idbench_chain
from idbench.identify.rows.rows import manageable

RANGE = (-0.02, 0.05)
"""Delays [s] of a first look: a filtered measurement is late by some milliseconds, a slow controller by some tens."""

WIDER, FARTHEST = 3.0, 0.6
"""How many times farther each further look goes, and how far at most [s]: two clocks of a recorder may be that far apart."""

SHARE = 0.05  # Share of a log that a delay may be: its rows must lie inside the log at all delays
DIFFERENT = 0.01  # Probability, of logs with one delay, below which their delays count as different
_COARSE = 15  # Delays of a first look, which brackets the smallest misfit


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
    of_logs: tuple[float, ...] = ()
    """Delay of each log [s], where they differ significantly; `sigma` contains their scatter."""

    def of(self, channel: TorqueChannel) -> TorqueChannel:
        """Return a channel with this delay."""
        return replace(channel, delay=self.delay, delay_sigma=self.sigma, lags=self.lags)

    @property
    def doubt(self) -> float:
        """The largest standard deviation [s]."""
        return float(np.max(self.sigma))

    def differs(self, channel: TorqueChannel, least: float) -> bool:
        """True if it differs from the delays of a channel by more than `least` [s]."""
        found, stated = (one.delay + np.asarray(one.lags or 0.0) for one in (self, channel))
        return bool((np.abs(found - stated) > least).any())

    @property
    def words(self) -> str:
        """It and its sigma in words."""
        sigma = ", ".join(f"{1e3 * x:.2g}" for x in np.atleast_1d(self.sigma))
        each = ", ".join(f"{1e3 * x:.3g}" for x in self.of_logs)
        differ = f"; the logs differ: {each} ms, identify them one by one" if each else ""
        return f"{self.of(TorqueChannel('held')).late}, sigma {sigma} ms{differ}"


def estimate_delay(
    log: MotionLog | Sequence[MotionLog], basis: Basis, chain: Chain | None = None, within: tuple[float, float] | None = None
) -> DelayEstimate:
    """Return the delay with which the explicit model explains the torques best.

    A search over delays, by the likelihood of Gaussian noise with a level of its own for each joint, brackets the best one; it
    goes farther as long as that lies at an end. The delay is then a parameter beside the others in generalized least squares,

        [X; delta] = argmin (Y + d delta - W X)' C^-1 (Y + d delta - W X),   d = dY/d(delay)

    repeated from what was found, with C of the noise there, until a step is below a tenth of its sigma: what is late counts as
    noise, and weights of a wrong delay keep it wrong. Logs whose own delays differ significantly are reported, and sigma
    contains their scatter.

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
    log: MotionLog | Sequence[MotionLog], basis: Basis, chain: Chain | None = None, within: tuple[float, float] | None = None
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
        If the delays do not converge.
    """
    common = estimate_delay(log, basis, chain, within)
    logs = manageable([log] if isinstance(log, MotionLog) else list(log))
    problem = Problem(tuple(logs), basis, ExplicitModel(), chain or idbench_chain())
    try:
        problem.rows.factors.together.check()
    except ExcitationError as error:
        problem = problem.with_basis(_without_hidden(basis, error))

    def of(delays: Array) -> DelayEstimate:
        mean = float(delays.mean())
        return DelayEstimate(mean, 0.0, tuple((delays - mean).tolist()))

    delays, sigma, move = newton(
        lambda delays: _delayed(problem, of(delays)),
        np.full(basis.n, common.delay),
        lambda each: [np.stack(part.delay_slopes(each=True), axis=-1) for part in each.parts],
    )
    if move <= SETTLED:
        return replace(of(delays), sigma=tuple(sigma.tolist()))
    advice = "does the model fit the robot? `estimate` finds one delay for all joints"
    raise RangeError(not_converged("the delays of the joints", move, ROUNDS, advice))


def _without_hidden(basis: Basis, error: ExcitationError) -> Basis:
    """Return the basis without what no torque depends on here, whenever it acts; raise the error if nothing is left."""
    if not error.hidden or len(error.hidden) >= len(basis.names):
        raise error
    return basis.without(*error.hidden)


def nearby_delay(problem: Problem) -> DelayEstimate:
    """The delay by one step of generalized least squares from the stated one, near which it must be.

    Parameters
    ----------
    problem : Problem
        Logs with one torque channel, and their rows.
    """
    (step,), (sigma,) = delay_step(problem.explicit, _slopes(problem.explicit))
    return DelayEstimate(problem.logs[0].torque.delay + float(step), float(sigma))


def _slopes(problem: Problem) -> list[Array]:
    """Derivatives of the rows of each log by one delay of all, shape (r, 1)."""
    return [part.delay_slopes(each=False)[0][:, None] for part in problem.parts]


def _delayed(problem: Problem, found: DelayEstimate) -> Problem:
    return problem.with_logs([replace(log, torque=replace(found.of(log.torque), delay_sigma=0.0)) for log in problem.logs])


def _with_scatter(problem: Problem, found: DelayEstimate) -> DelayEstimate:
    """The delay, with that of each log where they differ (Cochran's test), and their scatter in sigma (DerSimonian, Laird)."""
    slopes = _slopes(problem)
    own = [np.pad(D, [(0, 0), (k, len(slopes) - 1 - k)]) for k, D in enumerate(slopes)]
    step, sigma = delay_step(problem, own)
    shown = sigma > 0
    Q, variance = scatter(step[shown], sigma[shown] ** 2)
    if np.count_nonzero(shown) < 2 or scipy.special.chdtrc(np.count_nonzero(shown) - 1, Q) > DIFFERENT:
        return found
    sigma_of_all = float(np.sqrt(np.square(found.sigma) + variance))
    return replace(found, sigma=sigma_of_all, of_logs=tuple((found.delay + step).tolist()))


def _is_read(logs: Sequence[MotionLog], chain: Chain) -> bool:
    """True if the chain reads the delay of a log."""
    late = replace(logs[0], torque=replace(logs[0].torque, delay=1 / logs[0].fs))
    return not np.array_equal(chain.signals(late).torque.mean, chain.signals(logs[0]).torque.mean)


class _Search:
    def __init__(self, logs: list[MotionLog], basis: Basis, chain: Chain, within: tuple[float, float]) -> None:
        self._within = within
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
        """The delay by Newton steps from that of the search, or that of the search where a step leaves its bracket.

        Steps leave it where the model is far off.
        """
        found, sigma, move = newton(lambda delay: self._delayed(float(delay[0])), np.array([delay]), _slopes, within)
        if move > SETTLED:
            return DelayEstimate(delay, float(sigma[0]))
        estimate = DelayEstimate(float(found[0]), float(sigma[0]))
        return estimate if len(self._problem.logs) == 1 else _with_scatter(self._delayed(estimate.delay), estimate)

    def _delayed(self, delay: float) -> Problem:
        return _delayed(self._problem, DelayEstimate(delay, 0.0))

    def _misfit(self, delay: float) -> float:
        """Misfit of the rows at a delay, of which Y alone depends on it."""
        parts = zip(self._rows.maps, self._delayed(delay).logs, strict=True)  # with the prefilter found for their motion
        torques = (rows.measurement(self._chain.signals(log, rows.signals).torque.mean) for rows, log in parts)
        return float(replace(self._rows, Y=np.concatenate(list(torques))).factors.misfit())
