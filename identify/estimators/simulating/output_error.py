"""Output error by multiple shooting."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from idbench.identify.arrays import Array
from idbench.identify.errors import IdentificationError, require_positive
from idbench.identify.estimators.estimate import Estimate
from idbench.identify.estimators.estimator import Need
from idbench.identify.estimators.problem import Problem
from idbench.identify.estimators.simulating.row_products import Solved
from idbench.identify.estimators.simulating.simulated_rounds import AbstractSimulating, Rounds, require_explicit, small_steps
from idbench.identify.estimators.simulator import AbstractPlant
from idbench.identify.nuisances import Nuisances

STEP_Q, STEP_QD = 1e-5, 1e-4  # Changes of a state at the beginning of a segment [rad, rad/s]
LOST = 0.5  # Share of segments that may fail


@dataclass(frozen=True)
class OutputError(AbstractSimulating):
    """Output error (OE) by multiple shooting: the robot driven by the logged torques, X = argmin |q - q_s(X)|^2.

    The log is cut into segments, each with an initial state of its own, which is an unknown that is eliminated; in between the
    robot runs free. By Gauss-Newton, with 1 + p + 2 n simulations of every segment a round. Neither filter nor mask take part.
    It trusts the torques: noise in them is integrated twice, and makes it worse the longer segments are.
    """

    acronym: ClassVar[str] = "OE"
    needs: ClassVar[frozenset[Need]] = frozenset({"rows", "plant"})
    filtered: ClassVar[bool] = False

    length: float = 0.3
    """Of a segment [s]."""

    def __post_init__(self) -> None:
        super().__post_init__()
        require_positive(length=self.length)

    def solve(self, problem: Problem) -> Estimate:
        """Return the estimate of every run.

        Raises
        ------
        IdentificationError
            If the model is not the explicit one, a log has no two segments, or the simulated robots run away in every run.
        """
        require_explicit(problem, "OE", "positions")
        plant = problem.simulation.plant
        assert plant is not None
        if len({log.fs for log in problem.logs}) > 1:
            each = ", ".join(f"{log.fs:g}" for log in problem.logs)
            raise IdentificationError(f"OE takes logs of one frequency, these have {each} Hz: resample them, or use DIDIM")
        rounds, h = self.begun(problem), small_steps(problem)
        shots = {run: [_Shots(problem, plant, k, run, self.length) for k in range(len(problem.logs))]
                 for run in np.ndindex(rounds.simulations.shape)}  # fmt: skip

        def step(X: Array) -> Solved:
            found = [self._step(shots[run], X[run], h[run], rounds, run) for run in shots]
            shape = X.shape[:-1]
            return Solved(*(np.stack(x).reshape(*shape, *x[0].shape) for x in zip(*found, strict=True)))

        found = rounds.until_settled(step, rounds.start())
        return rounds.estimate(found, calibrated=found.covariance)

    def _step(
        self, shots: list["_Shots"], X: Array, h: Array, rounds: Rounds, run: tuple[int, ...]
    ) -> tuple[Array, Array, Array, Array]:
        """Return the parameters after a Gauss-Newton step of one run, and their covariance."""
        p = len(X)
        nothing = np.full(p, np.nan), np.zeros((0, p)), np.zeros(0), np.full((p, p), np.nan)
        if not rounds.active[run]:
            return nothing
        rounds.simulations[run] += 1 + p + 2 * rounds.problem.basis.n
        try:
            parts = [each.linearized(X, h) for each in shots]
        except IdentificationError as error:
            rounds.fail(run, str(error))
            return nothing
        e, J = (np.concatenate([part[i] for part in parts]) for i in (0, 1))
        weight = 1 / np.maximum(np.sqrt(np.mean(e**2, axis=(0, 1))), 1e-12)
        e, J = (e * weight).reshape(len(e), -1), (J * weight[:, None]).reshape(len(e), -1, p)
        size = np.sqrt(np.sum(J**2, axis=(0, 1)))
        size = np.where(size > 0, size, 1.0)
        J = J / size
        inverse = np.linalg.pinv(np.einsum("sip,siq->pq", J, J), hermitian=True)
        move = inverse @ np.einsum("sip,si->p", J, e)
        left = e - J @ move
        # Segments are independent of each other, their residuals are not within them.
        freedom = max(left.size - len(left) * 2 * len(weight) - p, 1) / left.size
        C = left.T @ left / len(left) / freedom
        covariance = inverse @ np.einsum("sip,ij,sjq->pq", J, C, J) @ inverse
        for each in shots:
            each.move(move / size)
        return X + move / size, np.zeros((0, p)), np.zeros(0), covariance / np.outer(size, size)


class _Shots:
    """The segments of a log of one run, and the states at which they begin; at its ends, without velocities, there are none."""

    def __init__(self, problem: Problem, plant: AbstractPlant, k: int, run: tuple[int, ...], length: float) -> None:
        whole, signals = problem.logs[k], problem.signals[k]
        log, count = whole.run(run), max(4, round(length * whole.fs))
        margin = int(np.ceil(problem.chain.margin(whole) * whole.fs))
        first = np.arange(margin, log.samples - margin - count, count)
        if len(first) < 2:
            raise IdentificationError(
                f"a log of {log.samples / log.fs:.3g} s has no two segments of {length:g} s: use a longer log"
            )
        qd = np.swapaxes(signals.state.qd[run], -1, -2)[first]
        self._plant = plant
        self._log = log
        self._first = first
        self._count = count
        self._states = np.concatenate([log.q[first], qd], axis=-1)
        self._measured = np.stack([log.q[k : k + count] for k in first.tolist()])
        self._of_X, self._rest = np.empty(0), np.empty(0)

    def linearized(self, X: Array, h: Array) -> tuple[Array, Array]:
        """Return residuals, shape (segment, count, joint), and their slopes by X, both without what initial states explain."""
        n = self._log.n
        p = len(X)
        segments = len(self._first)
        steps = np.array([*([STEP_Q] * n), *([STEP_QD] * n)])
        parameters = np.concatenate([X[None], X + np.diag(h), np.tile(X, (2 * n, 1))])
        moved = np.concatenate([np.zeros((1 + p, 2 * n)), np.diag(steps)])
        begin = moved[:, None] + self._states
        every = np.repeat(parameters, segments, axis=0), begin.reshape(-1, 2 * n)
        first = np.tile(self._first, len(parameters))
        q = self._plant.shoot(every[0], every[1][:, :n], every[1][:, n:], self._log, first, self._count)
        q = q.reshape(len(parameters), segments, self._count, n)
        good = np.asarray(np.isfinite(q).all(axis=(0, 2, 3)))
        if np.mean(good) < LOST:
            raise IdentificationError(
                f"{np.count_nonzero(~good)} of {segments} segments run away with these parameters: start closer to the truth"
            )
        e = np.where(good[:, None, None], self._measured - q[0], 0.0)
        slopes = np.where(good[:, None, None, None], np.moveaxis(q[1:] - q[0], 0, -1) / np.concatenate([h, steps]), 0.0)
        flat = slopes.reshape(segments, -1, p + 2 * n)
        states = Nuisances(np.where(good[:, None, None], flat[..., p:], np.eye(flat.shape[1], 2 * n)))
        both = np.concatenate([flat[..., :p], e.reshape(segments, -1, 1)], axis=-1)
        follow, free = states.following(both), states.without(both)
        self._of_X, self._rest = follow[..., :p], follow[..., p]
        return free[..., p].reshape(e.shape)[good], free[..., :p].reshape(*e.shape, p)[good]

    def move(self, step: Array) -> None:
        """Let the initial states follow a step of the parameters."""
        self._states = self._states + self._rest - self._of_X @ step
