"""Which moves show a parameter."""

from collections.abc import Sequence
from functools import cache
from itertools import combinations
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
import scipy

from idbench.identify.arrays import TINY, Array
from idbench.identify.basis.basis import Basis
from idbench.identify.data.kinematics import KinematicTree
from idbench.identify.estimators.estimate import Estimate
from idbench.identify.estimators.log_rows import noise_covariance
from idbench.identify.estimators.simulating.row_products import Kinds, with_weights
from idbench.identify.estimators.solution import Given
from idbench.identify.parameters.base_parameters import BaseParameters, columns_at, random_states
from idbench.identify.rows.factors import NOT_SHOWN

TELLING = 1e-6  # Variance of a direction of the difference, over the largest, below which it is rounding
LEVEL = 0.05  # Probability of a difference that large by chance, below which it is said to be real
MATTERS = 0.5  # Difference in sigma from which on it matters: half a sigma of bias makes 95 % intervals hold the truth in 92 %


class NoiseInRows(NamedTuple):
    """Whether estimates with and without noise in W differ by more than chance, run by run."""

    statistic: Array
    """d' V^+ d, with d the difference of the two estimates and V its covariance, shape (...)."""

    freedom: Array
    """Its degrees of freedom, shape (...)."""

    probability: Array
    """That chance alone makes it so large, shape (...)."""

    off: Array
    """By how many sigma least squares differs, shape (..., p)."""

    @property
    def matters(self) -> npt.NDArray[np.bool_]:
        """Whether the difference is real, and large enough to matter, shape (...): 16 bits make one that is real, and tiny."""
        return (self.probability < LEVEL) & (np.max(np.abs(self.off), axis=-1) > MATTERS)


def noise_in_rows(estimate: Estimate) -> NoiseInRows:
    """Durbin-Wu-Hausman test of the bias of least squares against instrumental variables.

    The difference of both estimates is (G_IV - G_LS)' r, with r the noise of the rows, if that in W does not matter; its
    covariance then follows from that of the rows, whichever of both is the more efficient (J. A. Hausman, "Specification tests
    in econometrics", Econometrica 46 (1978) 1251-1271; for robots A. Janot, P.-O. Vandanjon and M. Gautier, "A
    Durbin-Wu-Hausman test for industrial robots identification", Control Engineering Practice 48 (2016) 52-62).

    Parameters
    ----------
    estimate : Estimate
        By instrumental variables.
    """
    problem, rows = estimate.problem, estimate.rows
    kinds, of_IV = Kinds.of_rows(problem), estimate.influence()
    assert of_IV is not None
    plain = with_weights(rows.Y, rows.W, kinds.weights(np.nan_to_num(estimate.residual)))
    apart = Given(np.nan_to_num(of_IV - plain.G)).influence(problem.parts)
    V, size = np.nan_to_num(noise_covariance(problem, apart)), np.nan_to_num(estimate.own_sigma, nan=1.0)
    size = np.where(size > 0, size, 1.0)
    values, axes = np.linalg.eigh(V / size[..., :, None] / size[..., None, :])
    along = np.matmul(np.swapaxes(axes, -1, -2), (np.nan_to_num(estimate.X - plain.X) / size)[..., None])[..., 0]
    told = values > TELLING * values[..., -1:]
    statistic = np.sum(np.where(told, along**2 / np.where(told, values, 1.0), 0.0), axis=-1)
    freedom = np.sum(told, axis=-1)
    probability = scipy.special.chdtrc(np.maximum(freedom, 1), statistic)
    best = np.where(estimate.standard_errors > 0, estimate.standard_errors, 1.0)
    return NoiseInRows(statistic, freedom, probability, (plain.X - estimate.X) / best)


ENOUGH = 0.2  # Share of what a parameter adds of its own to the torques while all joints move, from which some of them will do
MOST_JOINTS = 3  # Joints of a move; what takes more of them counts as needing all
STATES = 200  # Random states of a move


def showing_moves(tree: KinematicTree, grouping: BaseParameters, names: Sequence[str]) -> dict[str, tuple[int, ...]]:
    """Return for each base parameter the fewest joints that show it when they move, from 0; all where it takes many.

    Some joints move at random, the others rest. A parameter shows by what its column has that no combination of
    the others has.

    Parameters
    ----------
    tree : KinematicTree
        The robot.
    grouping : BaseParameters
        Its base parameters.
    names : sequence of str
        Some of them.
    """
    basis, states = grouping.basis, random_states(tree, STATES)

    @cache
    def shown(joints: tuple[int, ...]) -> Array:
        moving = np.isin(np.arange(tree.n), joints)[:, None]  # the others stand where they are first
        q = np.where(moving, states[0], states[0, :, :1])
        return _shown(basis, np.stack([q, states[1] * moving, states[2] * moving]))

    every = tuple(range(tree.n))
    moves = [move for count in range(1, min(MOST_JOINTS, tree.n) + 1) for move in combinations(every, count)]
    whole, places = shown(every), {name: basis.names.index(name) for name in names}
    return {name: next((move for move in moves if shown(move)[i] >= ENOUGH * whole[i]), every) for name, i in places.items()}


def brisk_shares(tree: KinematicTree, basis: Basis, X: Array, sigma: Array) -> Array:
    """Share of a brisk motion's torque that one sigma of each parameter makes, at the joint where it is largest.

    The motion is one of random states at up to 5 rad/s and 25 rad/s^2: what a log leaves open shows there, if anywhere.

    Parameters
    ----------
    tree : KinematicTree
        The robot.
    basis : Basis
        The base parameters that were identified.
    X, sigma : Array, shape (b,)
        Estimate and standard deviations.

    Returns
    -------
    Array, shape (b,)
        Rms of the column times sigma, over the rms of the torque.
    """
    W = columns_at(basis, random_states(tree, STATES))
    torque = np.sqrt(np.mean(np.einsum("jpt,p->jt", W, X) ** 2, axis=-1))
    parts = np.sqrt(np.mean(W**2, axis=-1)) * sigma
    return np.max(parts / np.maximum(torque, TINY)[:, None], axis=0)


def _shown(basis: Basis, states: Array) -> Array:
    """Return the length of each column off all others, shape (b,)."""
    W = columns_at(basis, states)
    _, values, directions = np.linalg.svd(np.moveaxis(W, 1, -1).reshape(-1, len(basis.names)), full_matrices=False)
    seen = values > NOT_SHOWN * values[0]
    hidden = np.sum(directions[~seen] ** 2, axis=0) > NOT_SHOWN
    spread = np.sqrt(np.sum((directions[seen] / values[seen][:, None]) ** 2, axis=0))
    return np.divide(1.0, spread, out=np.zeros(len(spread)), where=~hidden & (spread > 0))
