"""Newton steps of delays, beside the parameters of generalized least squares."""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from idbench.identify.arrays import TINY, Array
from idbench.identify.estimators.leave_out import Stretches, jackknife, left_out
from idbench.identify.estimators.problem import Problem
from idbench.identify.iterate import iterate

ROUNDS, SETTLED = 10, 0.1  # Steps at most, and share of a sigma below which the last one must be: 1 % of sigma^2


def delay_step(problem: Problem, slopes: Sequence[Array]) -> tuple[Array, Array]:
    """Newton step of delays and its standard error, which the jackknife over stretches shows, shape (k,) each [s].

        [X; delta] = argmin (Y + D delta - W X)' C^-1 (Y + D delta - W X)

    Parameters
    ----------
    problem : Problem
        The explicit model, whose rows are kept.
    slopes : sequence of Array, shape (r, k)
        D = dY/d(delays) of the rows of each log [N m/s]; a column of zeros gives a step of zero.
    """
    parts, each = problem.parts, zip(problem.parts, slopes, strict=True)
    rows = [part.whitening.whiten(np.column_stack([part.unbiased.W, -D, part.rows.Y])) for part, D in each]
    found = left_out(Stretches.of(parts).products(parts, rows))[:, -slopes[0].shape[-1] :]
    return found[-1], np.sqrt(np.diagonal(jackknife(found[:-1])))


def newton(
    delayed: Callable[[Array], Problem],
    delays: Array,
    slopes: Callable[[Problem], list[Array]],
    within: tuple[float, float] = (-np.inf, np.inf),
) -> tuple[Array, Array, float]:
    """Delays after Newton steps, delta(k+1) = delta(k) + step, their standard errors, and the last step over these.

    None goes beyond a range: a step that would counts as infinite.
    """
    sigma: Array
    move: float

    def ahead(delays: Array) -> tuple[Array, bool]:
        nonlocal sigma, move
        problem = delayed(delays)
        step, sigma = delay_step(problem, slopes(problem))
        if not ((within[0] <= delays + step) & (delays + step <= within[1])).all():
            move = np.inf
            return delays, True
        move = float(np.max(np.abs(step) / np.maximum(sigma, TINY)))
        return delays + step, move <= SETTLED

    delays, _ = iterate(ahead, delays, ROUNDS)
    return delays, sigma, move


def torque_lateness(problem: Problem, j: int, late: float) -> float:
    """How late the torque of a joint is [s], by Newton steps from about where it is.

    Parameters
    ----------
    problem : Problem
        The explicit model, whose rows are kept.
    j : int
        The joint, from 0.
    late : float
        Lateness to first order [s].
    """

    def earlier(late: Array) -> Problem:
        lags = [np.array(log.torque.lags or np.zeros(log.n)) - float(late[0]) * np.eye(log.n)[j] for log in problem.logs]
        each = zip(problem.logs, lags, strict=True)
        return problem.with_logs([replace(log, torque=replace(log.torque, lags=tuple(x.tolist()))) for log, x in each])

    found, _, _ = newton(
        earlier, np.array([late]), lambda each: [-part.delay_slopes(each=True)[j][:, None] for part in each.parts]
    )
    return float(found[0])
