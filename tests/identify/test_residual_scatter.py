"""Sigma from autocorrelated residuals."""

from dataclasses import replace

import numpy as np
import pytest
import scipy

from idbench.identify.estimators.simulating.row_products import Kinds, scatter, with_weights


def test_the_scatter_of_correlated_residuals(rng):
    """Residuals that an autoregression makes, against its closed form."""
    N, a = 4000, 0.9
    white = rng.standard_normal((60, N))
    e = scipy.signal.lfilter([1.0], [1.0, -a], white)
    W = np.ones((60, N, 1))
    found = with_weights(e, W, np.ones((60, N)))
    sigma = np.sqrt(scatter(found, Kinds(1, np.ones((60, N))), [(slice(0, N), 100.0)])[:, 0, 0])
    assert np.mean(sigma) == pytest.approx(1 / (1 - a) / np.sqrt(N), rel=0.15)
    # A second kind that repeats the first three instants later: its G does so, too, or the other way round.
    late = np.stack([e, np.roll(e, 3, axis=-1)], axis=-1).reshape(60, -1)
    for lag in (3, -3):
        g = rng.standard_normal(N)
        G = np.stack([g, np.roll(g, lag)], axis=-1).reshape(-1, 1)
        one = replace(found, G=np.broadcast_to(G, (60, 2 * N, 1)), residual=late)
        made = np.sum(late * G[:, 0], axis=-1)
        variance = scatter(one, Kinds(2, np.ones((60, 2 * N))), [(slice(0, 2 * N), 100.0)])[:, 0, 0].mean()
        assert np.sqrt(variance) == pytest.approx(np.sqrt(np.mean(made**2)), rel=0.3)
    assert found.sigma.mean() < 0.4 * sigma.mean()
