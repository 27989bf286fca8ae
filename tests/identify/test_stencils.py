"""Windows that slide over samples are exact for the polynomials that they were made for."""

import numpy as np
import pytest

from idbench.identify import CentralDifference
from idbench.identify.signals.filters import averaged, shift

FS = 50.0
T = np.arange(40) / FS
INNER = slice(8, -8)


def polynomial(rng, degree):
    return np.polynomial.Polynomial(rng.normal(size=degree + 1))


@pytest.mark.parametrize("order", [2, 6])
def test_central_differences_are_exact_to_their_order(order, rng):
    p = polynomial(rng, order)
    derivative = CentralDifference(order).derivative(p(T), FS)
    np.testing.assert_allclose(derivative[INNER], p.deriv()(T)[INNER], atol=1e-11)


@pytest.mark.parametrize(("order", "droop"), [(2, lambda x: x**2 / 6), (6, lambda x: x**6 / 140)])
def test_central_differences_droop_as_documented(order, droop):
    w = 0.3 * FS  # rad/s
    slope = CentralDifference(order).derivative(np.sin(w * (T - T[20])), FS)[20]
    assert 1 - slope / w == pytest.approx(droop(w / FS), rel=0.05)  # the next term is 0.05 of it at w/fs = 0.3


@pytest.mark.parametrize("samples", [0, 1, -2, 0.5, -0.31, 1.7])
def test_shifts_are_exact_for_sixth_degree(samples, rng):
    p = polynomial(rng, 6)
    np.testing.assert_allclose(shift(p(T), samples)[INNER], p(T + samples / FS)[INNER], atol=1e-11)


def test_cell_averages_are_exact_for_cubics(rng):
    p = polynomial(rng, 3)
    integral = p.integ()
    mean = (integral(T + 0.5 / FS) - integral(T - 0.5 / FS)) * FS
    np.testing.assert_allclose(averaged(p(T), 1 / 12)[INNER], mean[INNER], atol=1e-12)
