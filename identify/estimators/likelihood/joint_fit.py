"""Motion and parameters that together make a log most likely."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
import scipy

from idbench.identify.arrays import TINY, Array
from idbench.identify.basis.basis import Basis
from idbench.identify.errors import IdentificationError
from idbench.identify.estimators.likelihood.cells import HELD, Cells
from idbench.identify.estimators.likelihood.normal_equations import Noise, NormalEquations, Solved, torque_squares
from idbench.identify.estimators.likelihood.reversals import Turns, stretches
from idbench.identify.iterate import iterate, not_converged
from idbench.identify.noise.linearization import friction_jumps, smoothed
from idbench.identify.noise.propagation import NoiseLevels
from idbench.identify.signals.masks import ReversalMask

ROUNDS, STEPS = 12, 12  # Rounds at most, in each of which mask and levels are frozen, and Gauss-Newton steps of each

RESTLESS = 3.0
"""Move of the last step, in sigma, above which parameters are refused: with coarse encoders masks may go to and fro, for a
sigma or so."""

NEXT = 0.5
"""Move of a step, in sigma, after which levels come next: steps converge quadratically, one more would move a thousandth."""

STEADY, LIKE = 0.05, 0.02
"""Change of the sigmas, in rms, from one set of levels to the next at which they count as settled, and of the levels at which
sigma need not be computed anew."""

FAR = 0.5
"""What is found over what is expected, below which the square of a level falls by the square of that: levels that are too high
are explained by motions that follow the noise, and would fall slowly."""

PROBES, MOST_PROBES = 16_000, 6
"""Random signs, over all cells, by which the leverage of the torques is estimated, and at most so many for each cell."""

CHECK = "check order and delay of the torques, and whether they were filtered, or use GLS"
"""What helps where torques and motion do not go together."""

UNKNOWN = 5.0  # Noise of the torque where friction's sign is not known, over the jump of friction there
TURNING = 0.3  # Half the difference of two torques near a reversal, over the level of their mean there
START = 0.1  # Level of the torques near reversals to begin with, over the jump of friction there
NEAR = 5.0  # How far velocities may then be from differences of the positions, over what noise and accelerations make of these
MASK = ReversalMask(width=0.02, taper=0.02)  # Where the sign of a velocity is no model of friction


@dataclass(frozen=True, eq=False)
class JointFit:
    """Parameters and motions of logs, together."""

    logs: tuple[Cells, ...]
    """Of one run each."""
    basis: Basis
    """The robot."""
    X: Array
    """Parameters, shape (p,)."""
    motions: tuple[Array, ...]
    """Q [rad] and qd [rad/s] at the nodes of each log, shape (node, 2, joint)."""
    levels: NoiseLevels
    """Noise of torques and positions."""
    delay: float | None = None
    """Change of the delays that the logs state [s], if it is unknown."""
    near: Array | None = None
    """Levels of the torques near reversals [N m], if these are used, shape (joint,)."""
    covariance: Array = field(default_factory=lambda: np.zeros((0, 0)))
    """Of the error of X, and of the delay if it is unknown, shape (p, p), or (p + 1, p + 1)."""
    left_out: str = ""
    """Why reversals, which were asked for, are left out; empty if they are used, or were not asked for."""

    @property
    def unknowns(self) -> Array:
        """Parameters, and the delay if it is unknown."""
        return self.X if self.delay is None else np.append(self.X, self.delay)

    def solved(self, floor: Array, steady: float = STEADY) -> "JointFit":
        """Return the fit whose likelihood is greatest; levels of the torques, not below `floor`, are found as well.

        Steps are of Gauss and Newton, u(k+1) = u(k) - A^-1 g with A and g of `normal_equations`; levels and steps take
        turns. They count as settled when sigmas change by less than the share `steady`, in rms.

        Raises
        ------
        IdentificationError
            If it diverges or does not settle, or the log does not determine the motion.
        """

        def leveled(before: tuple[JointFit, _Moved]) -> tuple[tuple[JointFit, _Moved], bool]:
            fit, last = before
            noises = fit._noises()
            now = iterate(lambda now: now.fit._step(noises), last._replace(fit=fit), STEPS)[0]
            like = np.sqrt(np.mean((now.sigma / last.sigma - 1) ** 2)) < steady
            return (now.fit._leveled(noises, now.taken, floor), now), now.move < NEXT and bool(like)

        begin = _Moved(self, np.inf, np.full(len(self.unknowns), np.inf), np.zeros(0))
        (fit, last), _ = iterate(leveled, (self, begin), ROUNDS, shown=True)
        if last.move > RESTLESS:
            raise IdentificationError(not_converged("motion and parameters together", last.move, ROUNDS, CHECK))
        same = np.allclose(fit.levels.torque, last.fit.levels.torque, rtol=LIKE)
        return fit if same else replace(fit, covariance=fit._reduced(fit._noises())[1])

    def with_reversals(self) -> "JointFit":
        """Return this fit as the start of one that uses friction through reversals."""
        jump = friction_jumps(self.basis, self.X, self.motions[0][0, 0])
        return replace(self, near=np.maximum(self.levels.torque, START * jump / 2))

    def _noises(self) -> list[Noise]:
        return [self.noise(k) for k in range(len(self.logs))]

    def _step(self, noises: list[Noise]) -> tuple["_Moved", bool]:
        """The fit after a Gauss-Newton step, and whether levels come next."""
        rng, n = np.random.default_rng(0), self.basis.n
        probes = int(np.clip(PROBES / sum(cells.count for cells in self.logs), 1, MOST_PROBES))
        signs = [rng.choice([-1.0, 1.0], (probes, n, cells.count)) for cells in self.logs]
        parts, covariance, b = self._reduced(noises, signs)
        taken = sum(np.sum(y[:, 1:] ** 2, axis=0) for _, y, _ in parts) + np.sum(b[:, 1:] * (covariance @ b[:, 1:]), axis=0)
        dX = covariance @ b[:, 0]
        motions = []
        for z, (V, y, L) in zip(self.motions, parts, strict=True):
            dz, _ = scipy.linalg.lapack.dtbtrs(L, y[:, 0] - V[:, : len(dX)] @ dX, uplo="L", trans="T")
            motions.append(z + dz.reshape(z.shape))
        sigma = np.sqrt(np.diag(covariance))
        moved = float(np.max(np.abs(dX) / np.sqrt(np.maximum(np.diag(covariance), TINY))))
        if not np.isfinite(moved) or not all(np.isfinite(z).all() for z in motions):
            raise IdentificationError(f"motion and parameters together diverge: {CHECK}")
        moved_on = replace(self, X=self.X + dX[: len(self.X)], motions=tuple(motions), covariance=covariance)
        ahead = moved_on if self.delay is None else moved_on._delayed(float(dX[-1]))
        taken = np.asarray(taken).reshape(2, n, -1).mean(axis=-1)
        return _Moved(ahead, moved, sigma, taken), moved <= NEXT

    def _delayed(self, change: float) -> "JointFit":
        """Return the fit with torques that act so much later [s]; the motion stays where the torques are."""
        logs = tuple(replace(cells, delay=cells.delay + change) for cells in self.logs)
        return replace(self, logs=logs, delay=(self.delay or 0.0) + change)

    def noise(self, k: int) -> Noise:
        """Return the standard deviations of a log's cells.

        Torques count for little where friction's sign is not known; where a joint reverses without a stop they have a level of
        their own, if there are any.
        """
        cells, z = self.logs[k], self.motions[k]
        q, qd, _ = cells.motion(z, 0.5)
        slow = smoothed(qd, cells.log.fs)
        weight = MASK.weight(slow, cells.log.fs)
        turns = Turns.none((self.basis.n, cells.count))
        if self.near is not None:
            turns = Turns.of(cells, self.basis, self.X, z, stretches(slow, weight < 1), self.near)
        lost = np.where(turns.near, 0.0, (1 - weight) * UNKNOWN * friction_jumps(self.basis, self.X, q[:, 0])[:, None])
        mean = np.where(turns.near, self._near[:, None], self.levels.torque[:, None])
        half = np.hypot(np.where(turns.near, TURNING, HELD) * mean, cells.rough)
        known = (weight == 1) & ~turns.near
        off = self._velocities(cells, lost == 0)
        return Noise(mean + lost, half + lost, self.levels.effective_position, known, *off, turns)

    @property
    def _near(self) -> Array:
        """Levels of the torques near reversals, shape (joint,)."""
        return self.levels.torque if self.near is None else self.near

    def _velocities(self, cells: Cells, known: npt.NDArray[np.bool_]) -> tuple[Array, Array]:
        """Tolerance of node velocities about differences of the positions, and these, shape (node, joint) each.

        Where the sign of friction is not known, torques leave the velocities to the positions, a sample a cell, between which
        they would swing. Differences are off by noise, and by what a joint that starts or stops accelerates in a period.
        """
        rate = _differences(cells)
        acceleration = np.sqrt(np.mean(np.gradient(smoothed(rate, cells.log.fs), cells.period, axis=-1) ** 2, axis=-1))
        off = NEAR * np.hypot(self.levels.position * cells.log.fs, acceleration * cells.period)
        beside = np.pad(~known, ((0, 0), (0, 1))) | np.pad(~known, ((0, 0), (1, 0)))
        return np.where(beside, off[:, None], np.inf).T, _at_nodes(cells, rate)

    def _leveled(self, noises: list[Noise], taken: Array, floor: Array) -> "JointFit":
        """Return the fit with levels of the torques from the residuals, of which the unknowns absorb a part."""
        each = zip(self.logs, self.motions, noises, strict=True)
        squares = sum(torque_squares(cells, self.basis, self.X, z, noise) for cells, z, noise in each)
        cells = sum(np.stack([np.count_nonzero(x, axis=-1) for x in (noise.known, noise.turns.near)]) for noise in noises)
        free = np.maximum(cells - taken, 1e-3 * cells)
        ratio = np.divide(squares, free, out=np.ones_like(taken), where=cells > 0)
        factor = np.where(ratio < FAR, ratio, np.sqrt(ratio))
        torque, near = (np.maximum(x * y, floor) for x, y in zip((self.levels.torque, self._near), factor, strict=True))
        return replace(self, levels=replace(self.levels, torque=torque), near=None if self.near is None else near)

    def _reduced(self, noises: list[Noise], signs: Sequence[Array | None] | None = None) -> tuple[list[Solved], Array, Array]:
        """Return solutions, and the covariance of the unknowns and their right-hand sides with the motions eliminated."""
        each = signs or [None] * len(self.logs)
        systems = [
            NormalEquations.of(cells, self.basis, self.X, z, noise, some)
            for cells, z, noise, some in zip(self.logs, self.motions, noises, each, strict=True)
        ]
        parts, count = [system.solved() for system in systems], len(self.unknowns)
        S = np.asarray(sum(system.corner - V.T @ V for system, (V, _, _) in zip(systems, parts, strict=True)))[:count, :count]
        b = np.asarray(sum(system.b_parameters - V.T @ y for system, (V, y, _) in zip(systems, parts, strict=True)))[:count]
        size = np.sqrt(np.maximum(np.diag(S), TINY))
        return parts, np.linalg.pinv(S / np.outer(size, size), hermitian=True) / np.outer(size, size), b


class _Moved(NamedTuple):
    """A fit after a Gauss-Newton step; its largest change of a parameter, in sigma, and sigma of each.

    `taken` are the numbers of cells whose mean torques the unknowns explain in any case, shape (2, joint).
    """

    fit: JointFit
    move: float
    sigma: Array
    taken: Array


def logged_motion(cells: Cells) -> Array:
    """Return positions and velocities at the nodes of a log, by parabolas through its positions."""
    q, rate = cells.log.q.T, _differences(cells)
    qd = _at_nodes(cells, smoothed(rate, cells.log.fs))
    _, beyond = _nodes(cells)
    return np.stack([_at_nodes(cells, q) + qd * beyond[:, None], qd], axis=1)


def _differences(cells: Cells) -> Array:
    """Return central differences of the positions, shape (joint, sample)."""
    return np.gradient(cells.log.q.T, cells.period, axis=-1)


def _nodes(cells: Cells) -> tuple[Array, Array]:
    """Instants of the nodes within the log [s], and their distance beyond its ends."""
    nodes = np.arange(cells.count + 1) * cells.period + cells.delay
    inside = np.clip(nodes, 0, (cells.log.samples - 1) * cells.period)
    return inside, nodes - inside


def _at_nodes(cells: Cells, x: Array) -> Array:
    """Return values x of the samples, shape (joint, sample), at the nodes, shape (node, joint), by straight lines."""
    inside, _ = _nodes(cells)
    return np.stack([np.interp(inside, np.arange(cells.log.samples) * cells.period, one) for one in x], axis=-1)
