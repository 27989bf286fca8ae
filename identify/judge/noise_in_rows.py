"""Does noise of the positions in W matter? The test of Durbin, Wu and Hausman."""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt
import scipy

from idbench.identify.arrays import Array
from idbench.identify.estimators.estimate import Estimate
from idbench.identify.estimators.propagated import noise_covariance
from idbench.identify.estimators.simulating.row_products import Kinds, with_weights
from idbench.identify.estimators.solution import Given

TELLING = 1e-6
"""Variance of a direction of the difference, over the largest, below which it is rounding."""

LEVEL = 0.05
"""Probability of a difference that large by chance, below which it is said to be real."""

MATTERS = 0.5
"""Difference in sigma from which on it matters: half a sigma of bias makes 95 % intervals hold the truth in 92 %."""


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
    """Return whether least squares has a bias that instrumental variables have not.

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
    probability = scipy.stats.chi2.sf(statistic, np.maximum(freedom, 1))
    best = np.where(estimate.standard_errors > 0, estimate.standard_errors, 1.0)
    return NoiseInRows(statistic, freedom, probability, (plain.X - estimate.X) / best)
