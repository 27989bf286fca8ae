"""Estimators that simulate the robot with the parameters of the round before, until these no longer move."""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import ClassVar, final

import numpy as np
import numpy.typing as npt

from idbench.identify.arrays import Array, frozen
from idbench.identify.data.motion_log import MotionLog
from idbench.identify.errors import IdentificationError, require_positive, require_whole
from idbench.identify.estimators.estimate import Estimate
from idbench.identify.estimators.estimator import AbstractEstimator, Need
from idbench.identify.estimators.problem import Problem
from idbench.identify.estimators.simulating.row_products import Solved
from idbench.identify.estimators.simulator import Simulated
from idbench.identify.estimators.solution import AbstractSolution
from idbench.identify.iterate import by_run, iterate, not_converged
from idbench.identify.models import ExplicitModel

SMALL = 1e-3  # Change of a parameter, as a share of what makes the whole torque of a joint

NOTHING = 1e-2
"""Steps that make less than this share of 0.1 % of the torque count as none, however sure the estimate is of itself."""

UNSETTLED = 1.0  # Remaining distance, in sigma, at which an estimate that has not converged is kept after the last step

MAX_DEVIATION, MAX_FIRST_DEVIATION = 0.1, 0.3
"""Rms by which a simulated motion may differ from the logged one in the end, and in the first round, as a share of the rms of
the logged motion about its mean."""


FARTHEST = 1.0  # Share of the last two answers' difference by which the next round may begin beyond the last answer


class SecantSteps:
    """Rounds that leave a share of what was left, each direction its own.

    How much of its beginning an answer keeps is known along the line through the last two rounds. The next round begins where
    their steps along it cross zero (D. G. Anderson, "Iterative procedures for nonlinear integral equations", J. ACM 12 (1965)
    547-560, with a memory of one). Of the rest of a step half is taken to be left, at most.
    """

    def __init__(self) -> None:
        self._before: tuple[Array, Array] | None = None

    def taken(self, X: Array, G: Array, unit: Array) -> tuple[Array, Array]:
        """Return an upper bound of the remaining distance [units], shape (...), and the start of the next step, shape (..., p).

        X and G are the parameters before and after the round; a step counts in `unit`, such as sigma, shape (..., p) each.
        """
        before, self._before = self._before, (X, G)
        step = (G - X) / unit
        if before is None:
            return largest(step), G
        answered = G - before[1]
        change = (answered - (X - before[0])) / unit
        square = np.sum(change**2, axis=-1, keepdims=True)
        c = np.divide(np.sum(change * step, axis=-1, keepdims=True), square, out=np.zeros_like(square), where=square > 0)
        left = largest(c * answered / unit) + largest(step - c * change)
        return left, G - np.where(np.abs(c) <= FARTHEST, c, 0.0) * answered


def largest(steps: Array) -> Array:
    """Largest step of a parameter, by size, shape (...)."""
    found: Array = np.max(np.abs(steps), axis=-1)
    return found


@dataclass(eq=False)
class Rounds:
    """What has been simulated, run by run."""

    problem: Problem
    """What is solved."""
    most: int
    """Rounds at most."""
    settled: float
    """Remaining distance, in sigma, below which parameters count as converged."""
    exact: bool = True
    """Whether the simulated robot must have all parameters of the problem."""
    path: list[Array] = field(default_factory=list)
    failures: dict[tuple[int, ...], str] = field(default_factory=dict)
    simulations: npt.NDArray[np.intp] = field(init=False)
    _last: tuple[MotionLog, ...] = ()
    _informed: bool = False
    _small: Array = field(init=False)
    active: npt.NDArray[np.bool_] = field(init=False)

    def __post_init__(self) -> None:
        runs = self.problem.factors.together.status.shape
        self._small = small_steps(self.problem)
        self.simulations, self.active = np.zeros(runs, dtype=np.intp), np.ones(runs, dtype=bool)

    def start(self) -> Array:
        """Initial parameters, shape (..., p)."""
        X = starting_point(self.problem)
        self._require_finite(X, "its rows do not determine the parameters")
        self.path.append(X)
        return X

    def until_settled(self, step: Callable[[Array], Solved], X: Array, steps: SecantSteps | None = None) -> Solved:
        """Return the solution of `step` that does not move any more; runs that have converged are left as they are.

        A round whose controller was made for the simulated robot is not the last: the real one was not. It begins at X, shape
        (..., p). By default, remaining distance and start of the next step are the move and the end of the last one.
        """
        found: Solved | None = None
        move = np.full(X.shape, np.inf)
        left = np.full(X.shape[:-1], np.inf)

        def round_(X: Array) -> tuple[Array, bool]:
            nonlocal found, move, left
            new = step(X)
            self._require_finite(new.X, "the simulated motion does not determine the parameters")
            found = new.where(self.active, found) if found else new
            unit = np.maximum(new.sigma, NOTHING * self._small)
            with np.errstate(invalid="ignore", divide="ignore"):
                move = np.where(self.active[..., None], np.abs(new.X - X) / unit, move)
                if steps and not self._informed:
                    now, after = steps.taken(X, new.X, unit)
                else:  # steps that converge faster than can be extrapolated, or a first round that was another one
                    now, after = largest((new.X - X) / unit), new.X
            left = np.where(self.active, np.inf if self._informed else now, left)
            self.path.append(found.X)
            self.active &= ~(left < self.settled)
            return by_run(after, self.active, X), not self.active.any()

        iterate(round_, X, self.most, shown=True)
        self._require_same_motion(MAX_DEVIATION)
        for run in map(tuple, np.argwhere(self.active & ~(left < UNSETTLED)).tolist()):
            k = int(np.argmax(move[run]))
            advice = "does the simulated loop have the log's controller and motion? If so, start closer to the true parameters"
            self.fail(run, not_converged(self.problem.names[k], float(move[run][k]), self.most, advice))
        assert found is not None  # there is a round at least
        return found

    def simulated(self, X: Array) -> Simulated:
        """Return the logs of robots with these parameters, shape (..., run, p); those of runs that failed mean nothing.

        In the first round the controller knows the robot, so that it follows the motion, however far off the start is.
        """
        self._informed = not self.simulations.any()
        loop = self.problem.simulation.loop
        assert loop is not None  # an estimator says that it needs one
        found = loop.repeat(np.nan_to_num(X), informed=self._informed, exact=self.exact)
        extra = X.ndim - 1 - self.simulations.ndim
        for place, why in found.failures.items():
            if self.active[place[extra:]]:  # one that has converged stays
                self.fail(place[extra:], why)
        self.simulations += self.active * int(np.prod(X.shape[:extra], dtype=np.intp))
        self._last = tuple(replace(log, q=log.q[(0,) * extra], tau=log.tau[(0,) * extra], conditions={}) for log in found.logs)
        if self._informed:
            self._require_same_motion(MAX_FIRST_DEVIATION)
        return found

    def _require_same_motion(self, most: float) -> None:
        """Let runs fail whose simulated motion, if a loop was simulated, is not that of their log."""
        spreads = [np.std(measured.q, axis=-2) for measured in self.problem.logs]
        widest = np.max([spread.max(axis=-1) for spread in spreads], axis=0)[..., None]  # a log may hold a pose
        for measured, simulated, moved in zip(self.problem.logs, self._last, spreads, strict=False):
            off = np.sqrt(np.mean((simulated.q - measured.q) ** 2, axis=-2))
            for *run, j in np.argwhere(off > most * widest).tolist():
                self.fail(
                    tuple(run),
                    f"the simulated motion of joint {j + 1} strays by {off[(*run, j)]:.2g} (rms; rad or m) from that of the "
                    f"log, which moves by {moved[(*run, j)]:.2g}: the loop has another motion, controller or sampling instant",
                )

    def fail(self, run: tuple[int, ...], why: str) -> None:
        """Let a run fail, for the first reason that is found."""
        self.failures.setdefault(run, why)
        self.active[run] = False

    def estimate(self, found: Solved, *, solution: AbstractSolution | None = None, calibrated: Array | None = None) -> Estimate:
        """Return the estimate of a solution, NaN in the runs that failed; raise IdentificationError if all did."""
        if len(self.failures) == self.active.size:
            raise IdentificationError(next(iter(self.failures.values())))
        X, covariance = found.X.copy(), found.covariance
        for run in self.failures:
            X[run] = np.nan
        return Estimate(
            self.problem,
            frozen(X),
            frozen(covariance),
            solution,
            calibrated=None if calibrated is None else frozen(calibrated),
            failures=self.failures,
            path=tuple(self.path),
            simulations=self.simulations,
        )

    def _require_finite(self, X: Array, why: str) -> None:
        for run in map(tuple, np.argwhere(self.active & ~np.isfinite(X).all(axis=-1)).tolist()):
            self.fail(run, why)


@dataclass(frozen=True)
class AbstractSimulating(AbstractEstimator):
    """An estimator that simulates the robot in rounds."""

    needs: ClassVar[frozenset[Need]] = frozenset({"rows", "loop"})
    begins: ClassVar[bool] = True

    rounds: int = 15
    """Rounds at most."""
    settled: float = 0.05
    """Remaining distance, in sigma, below which parameters count as converged."""

    def __post_init__(self) -> None:
        require_whole(1, rounds=self.rounds)
        require_positive(settled=self.settled)

    @final
    def begun(self, problem: Problem, *, exact: bool = True) -> Rounds:
        """Return the rounds of a problem, before the first."""
        return Rounds(problem, self.rounds, self.settled, exact)


def require_explicit(problem: Problem, name: str, what: str, other: str = "") -> None:
    """Raise IdentificationError unless the model is the explicit one, for an estimator that does not compare rows."""
    if not isinstance(problem.model, ExplicitModel):
        raise IdentificationError(
            f"{name} compares {what}, not rows: it has the explicit model alone (--model explicit){other}"
        )


def starting_point(problem: Problem) -> Array:
    """Initial parameters of estimators that simulate or filter, shape (..., p): given, or by weighted least squares."""
    if problem.simulation.start is None:
        return problem.scaled_factors.fit(2).X
    shape = *problem.factors.together.status.shape, len(problem.names)
    return np.broadcast_to(problem.simulation.start, shape).astype(np.float64)


def rates(problem: Problem) -> list[tuple[slice, float]]:
    """Rows of each log, and their rate [1/s]."""
    maps = problem.rows.maps
    ends = np.cumsum([part.rows for part in maps]).tolist()
    return [(slice(end - part.rows, end), part.signals.fs / part.grid.step) for part, end in zip(maps, ends, strict=True)]


def small_steps(problem: Problem) -> Array:
    """Return small changes of the parameters, shape (..., p): in every kind of row below `SMALL` of the torque's rms."""
    rows = problem.rows
    W = rows.W.reshape(*rows.W.shape[:-2], -1, rows.kinds, rows.W.shape[-1])
    Y = rows.Y.reshape(*rows.Y.shape[:-1], -1, rows.kinds)
    columns, torque = np.sqrt(np.mean(W**2, axis=-3)), np.sqrt(np.mean(Y**2, axis=-2))
    share = np.max(columns / np.where(torque > 0, torque, np.inf)[..., None], axis=-2)
    return SMALL / np.where(share > 0, share, 1.0)
