"""Maximum likelihood of motion and parameters together."""

from dataclasses import dataclass, replace
from typing import ClassVar, NamedTuple

import numpy as np
import scipy

from idbench.identify.arrays import Array, frozen
from idbench.identify.data.motion_log import MotionLog
from idbench.identify.errors import IdentificationError
from idbench.identify.estimators.estimate import Estimate
from idbench.identify.estimators.estimator import AbstractEstimator, Need
from idbench.identify.estimators.least_squares.ordinary_weighted_generalized import GeneralizedLeastSquares
from idbench.identify.estimators.likelihood.cells import Cells, hermite
from idbench.identify.estimators.likelihood.joint_fit import CHECK, JointFit, logged_motion
from idbench.identify.estimators.likelihood.normal_equations import NormalEquations
from idbench.identify.estimators.problem import Problem
from idbench.identify.models import ExplicitModel
from idbench.identify.noise.band_matrix import BandMatrix, Cholesky
from idbench.identify.noise.propagation import NoiseLevels
from idbench.identify.noise.restricted_likelihood import SMALLEST
from idbench.identify.noise.white_noise import EXACT
from idbench.identify.rows.factors import Status


class SmoothedMotion(NamedTuple):
    """A motion and its standard deviations, shape (time, joint)."""

    t: Array
    """Instants [s], shape (time,)."""

    q: Array
    qd: Array
    qdd: Array
    sigma_q: Array
    sigma_qd: Array
    sigma_qdd: Array


def smoothed_motion(fit: JointFit, log: int = 0, t: Array | None = None) -> SmoothedMotion:
    """Return the motion of a log as positions, torques and the robot's equation together say.

    Parameters
    ----------
    fit : JointFit
        A maximum-likelihood fit, such as `estimate.fits[()]`.
    log : int
        Which of its logs.
    t : Array, shape (time,), optional
        Instants [s]; by default those of the log's samples, as far as its torques go.

    Raises
    ------
    IdentificationError
        If an instant lies beyond the torques of the log.
    """
    cells, z = fit.logs[log], fit.motions[log]
    fs = cells.log.fs
    given = np.flatnonzero(cells.inside) / fs if t is None else np.asarray(t, dtype=np.float64)
    at = (given - cells.delay) * fs
    if len(at) and (at.min() < -1e-6 or at.max() > cells.count + 1e-6):
        last = cells.delay + cells.count / fs
        raise IdentificationError(f"instants must lie in {cells.delay:g} to {last:g} s, where torques are known")
    cell = np.clip(np.floor(at + 1e-9).astype(np.intp), 0, cells.count - 1)
    weights = hermite(at - cell, 1 / fs)
    ends = np.stack([z[cell, 0], z[cell, 1], z[cell + 1, 0], z[cell + 1, 1]])
    covariance = _covariance(fit, log)[cell]
    values = [np.einsum("kt,ktj->tj", w, ends) for w in weights]
    sigmas = [np.sqrt(np.einsum("kt,tjkm,mt->tj", w, covariance, w)) for w in weights]
    return SmoothedMotion(given, *values, *sigmas)


def smoothed_log(fit: JointFit, log: int = 0) -> MotionLog:
    """Return a log of the smoothed positions and their torques, with the delay of the fit, for other models or estimators."""
    cells, motion = fit.logs[log], smoothed_motion(fit, log)
    first = round(motion.t[0] * cells.log.fs)
    tau, torque = cells.log.tau[first : first + len(motion.q)], replace(cells.log.torque, delay=cells.delay)
    return MotionLog(cells.log.fs, motion.q, tau, torque, cells.log.conditions)


def _covariance(fit: JointFit, log: int) -> Array:
    """Return the covariance of (q0, qd0, q1, qd1) of every cell and joint, shape (cell, joint, 4, 4)."""
    cells, z = fit.logs[log], fit.motions[log]
    system = NormalEquations.of(cells, fit.basis, fit.X, z, fit.noise(log))
    V, _, L = system.solved()
    inverse = _windows(Cholesky(np.ascontiguousarray(L.T)).inverse(), cells.log.n)
    U, _ = scipy.linalg.lapack.dtbtrs(L, V, uplo="L", trans="T")
    of_X = U[:, : len(fit.unknowns)].reshape(len(z), 2, cells.log.n, -1)
    pairs = np.concatenate([of_X[:-1], of_X[1:]], axis=1).transpose(0, 2, 1, 3)
    return inverse + np.matmul(np.matmul(pairs, fit.covariance), np.swapaxes(pairs, -1, -2))


def _windows(inverse: BandMatrix, n: int) -> Array:
    """Blocks of the inverse at both nodes of every cell, joint by joint, shape (cell, joint, 4, 4)."""
    cells = len(inverse.lower) // (2 * n) - 1
    found, first = np.zeros((cells, n, 4, 4)), 2 * n * np.arange(cells)[:, None] + np.arange(n)
    for k in range(4):
        for m in range(k, 4):
            found[..., k, m] = found[..., m, k] = inverse.lower[first + n * k, n * (m - k)]
    return found


FAR = 15.0
"""Sigmas from the generalized least-squares estimate beyond which a fit is not accepted: noise alone, of a 10-bit encoder,
takes one 7 sigma far. Where torques do not belong to the motion, parameters of zero, with which nothing moves, are as good as
any."""

APART = 3.0  # The same where its own sigma is below the share `SMALL` of that estimate's
SMALL = 1e-2  # Share of sigma below which a fit claims to know far more than the estimate that it began with

BEGIN = 1e-3
"""Noise of the torques, over their rms, from which the search begins at least: from the levels of logs without torque noise
(1e-5), 4 of 32 searches with 12-bit encoders end elsewhere; from 1e-2 and 5e-2 none does, as from this."""

NOTHING = 0.9
"""Share of the rms torque of all joints above which noise leaves nothing to the motion: less than a fifth of its square."""

FINE = 0.02  # Change of the sigmas from one set of levels to the next at which reversals are used up: they come slowly
WORTH = 0.9  # Typical sigma, over that of a fit without reversals, below which these are used
MAX_BYTES = 2e9  # Bytes that the equations of all motions may take


@dataclass(frozen=True)
class MaximumLikelihood(AbstractEstimator):
    """Maximum likelihood (ML) of motion and parameters together, from positions and torques as they were logged.

        min over q(t), X of  sum |q_k - q(t_k)|^2 / sigma_q^2 + sum |tau - D(q, qd, qdd) X|^2 / sigma_tau^2

    Least squares takes the filtered, differentiated positions for the motion; here it is unknown, a cubic polynomial between
    the instants at which the torque changes. Where the sign of a velocity says nothing of friction, torques count for next to
    nothing. It begins at the generalized least-squares solution and its noise levels, and finds those of the torques anew. No
    filter takes part.
    """

    acronym: ClassVar[str] = "ML"
    needs: ClassVar[frozenset[Need]] = frozenset({"logs"})
    filtered: ClassVar[bool] = False

    find_delay: bool = False
    """Whether the delay of the torques is one more unknown, one for all logs, from what they state; it is
    `estimate.fits[()].delay` [s], more than what was stated."""
    reversals: bool = False
    """Whether friction that jumps at a reversal, as its law says, is used, instead of being left out. Torques near reversals
    have a level of noise of their own, which is large where friction near rest is not what the law says."""

    def solve(self, problem: Problem) -> Estimate:
        """Return the estimate of every run.

        Raises
        ------
        IdentificationError
            If the model is not the explicit one, the logs are too long, or motion and parameters diverge.
        """
        if not isinstance(problem.model, ExplicitModel):
            raise IdentificationError("ML has the torque equation of the explicit model: use --model explicit, or GLS")
        _require_short(problem)
        # Rows show little of the positions' noise where torques are noisy; their differences show all of it.
        start, position = GeneralizedLeastSquares().solve(problem), np.maximum(problem.position_noise, SMALLEST)
        torque = problem.likely_noise.torque.copy()
        runs = start.X.shape[:-1]
        p = len(problem.names)
        failures = dict[tuple[int, ...], str]()
        X, covariance = np.full((*runs, p), np.nan), np.full((*runs, p, p), np.nan)
        fits: dict[tuple[int, ...], JointFit] = {}
        for run in np.ndindex(runs):
            if start.status[run] != Status.OK or not np.isfinite(start.X[run]).all():
                continue
            try:
                found = self._found(problem, run, start, NoiseLevels(torque[run], position[run], problem.repeats[run]))
            except IdentificationError as error:  # one run does not take the others away
                failures[run] = str(error)
                continue
            fits[run] = found
            X[run] = found.X
            covariance[run] = found.covariance[:p, :p]
            torque[run] = np.where(np.isfinite(torque[run]), found.levels.torque, np.nan)
        if failures and not fits:
            raise IdentificationError(next(iter(failures.values())))
        calibrated = frozen(covariance)
        levels = NoiseLevels(torque, position, problem.repeats)
        return Estimate(problem, frozen(X), calibrated, calibrated=calibrated, levels=levels, fits=fits, failures=failures)

    def _found(self, problem: Problem, run: tuple[int, ...], start: Estimate, levels: NoiseLevels) -> JointFit:
        """Return the fit of one run."""
        alone = tuple(log.run(run) for log in problem.logs)
        logs = tuple(map(Cells.of, alone))
        rms = np.sqrt(np.mean([np.mean(cells.torque[0] ** 2, axis=-1) for cells in logs], axis=0))
        # A joint at rest does not determine its torque.
        torque = np.where(np.isfinite(levels.torque), np.maximum(levels.torque, BEGIN * rms), rms)
        own = NoiseLevels(torque, levels.position, levels.repeats)
        delay, motions = (0.0 if self.find_delay else None), tuple(map(logged_motion, logs))
        begin = JointFit(logs, problem.basis, start.X[run], motions, own, delay)
        found = _through_reversals(begin, EXACT * rms) if self.reversals else begin.solved(EXACT * rms)
        X, sigma = start.X[run], start.own_sigma[run]
        if found.delay is not None:
            later = [replace(log, torque=replace(log.torque, delay=log.torque.delay + found.delay)) for log in alone]
            again = GeneralizedLeastSquares().solve(Problem(tuple(later), problem.basis, problem.model, problem.chain))
            X, sigma = again.X, again.own_sigma
        _require_near(found, X, sigma, problem.names)
        if np.linalg.norm(found.levels.torque) > NOTHING * np.linalg.norm(rms):
            raise IdentificationError(f"the motion explains none of the torques, which look like noise: {CHECK}")
        return found


def _through_reversals(begin: JointFit, floor: Array) -> JointFit:
    """Return the fit that uses friction through reversals, or the one that leaves them out if it is next to no better.

    Where friction near rest is not what its law says, the level of the torques there is large, and little is gained: what the
    reversals say is then as likely wrong as right.
    """
    masked = begin.solved(floor)
    try:
        used = masked.with_reversals().solved(floor, FINE)
    except IdentificationError as error:
        return replace(masked, left_out=str(error))
    gained = 1 - np.sqrt(np.exp(np.mean(np.log(np.diag(used.covariance) / np.diag(masked.covariance)))))
    if gained > 1 - WORTH:
        return used
    less = f"{100 * gained:.2g} % less" if gained > 0 else "no less"
    return replace(masked, left_out=f"sigma would be {less}, but only if friction near rest followed its law")


def with_delay() -> MaximumLikelihood:
    """Maximum likelihood (ML) of motion, parameters and the delay of the torques together."""
    return MaximumLikelihood(find_delay=True)


def with_reversals() -> MaximumLikelihood:
    """Maximum likelihood (ML) that uses how friction jumps where joints reverse."""
    return MaximumLikelihood(reversals=True)


def _require_near(found: JointFit, X: Array, sigma: Array, names: tuple[str, ...]) -> None:
    """Raise IdentificationError if a fit went so far from where it began that another minimum caught it."""
    far, small = np.abs(found.X - X) / sigma, np.sqrt(np.diag(found.covariance)[: len(X)]) / sigma
    wrong = (far >= FAR) | ((small <= SMALL) & (far > APART))
    if not wrong.any():
        return
    k = int(np.where(wrong, far, -1.0).argmax())
    raise IdentificationError(
        f"motion and parameters together disagree with generalized least squares: {names[k]} is {found.X[k]:.4g} instead of "
        f"{X[k]:.4g}, sigma {np.sqrt(found.covariance[k, k]):.2g} instead of {sigma[k]:.2g}: {CHECK}"
    )


def _require_short(problem: Problem) -> None:
    n, p = problem.basis.n, len(problem.names)
    samples = sum(log.samples for log in problem.logs)
    if (size := samples * 2 * n * (3 * p + 20 * n) * 8) > MAX_BYTES:
        raise IdentificationError(
            f"motion and parameters of {samples} samples of {n} joints together take {size / 1e9:.3g} GB: use GLS, or at most "
            f"{int(samples * MAX_BYTES / size)} samples"
        )
