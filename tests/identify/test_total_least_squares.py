"""Total least squares, and where it has no answer."""

from dataclasses import replace

import numpy as np
import pytest
from builders import closed

from idbench.identify import ExplicitModel, IdentificationError, NoPrefilter, idbench_chain, identify, scara
from idbench.identify.estimators import TotalLeastSquares


def test_total_least_squares_refuses_where_noise_hides_the_answer():
    """With ten bits up to 20 Hz columns of W are noise."""
    _, coarse = closed(10)
    chain = idbench_chain()
    wide = replace(chain, prefilter=NoPrefilter(), operator=replace(chain.operator, cutoff=20.0))
    with pytest.raises(IdentificationError, match="total least squares has no answer"):
        identify(coarse, scara(), ExplicitModel(), wide, TotalLeastSquares())


def test_total_least_squares_is_that_of_the_textbook(rng):
    """Van Huffel and Vandewalle: X of the last right singular vector, where all columns and Y have the same noise."""
    from idbench.identify.estimators.least_squares.total_least_squares import _solved

    A = rng.standard_normal((200, 4))
    R, S = np.linalg.qr(A, mode="r"), 200 * 0.01 * np.eye(4)
    with pytest.raises(IdentificationError, match="no answer"):
        _solved(R, S)  # of random numbers there is none
    A[:, 3] = A[:, :3] @ [1.0, -2.0, 0.5] + 0.1 * rng.standard_normal(200)
    v = np.linalg.svd(A)[2][-1]
    np.testing.assert_allclose(_solved(np.linalg.qr(A, mode="r"), S)[0], -v[:3] / v[3], rtol=1e-9)
    exact = S.copy()
    exact[:3, :3] = 0.0  # W without noise: least squares
    np.testing.assert_allclose(_solved(np.linalg.qr(A, mode="r"), exact)[0], np.linalg.lstsq(A[:, :3], A[:, 3])[0], rtol=1e-9)
