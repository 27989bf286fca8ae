"""The minimum of a function of one number, against SciPy's."""

import numpy as np
import pytest
from scipy.optimize import minimize_scalar

from idbench.identify.iterate import minimum

FUNCTIONS = {
    "parabola": (lambda x: (x - 0.3) ** 2, -1.0, 2.0),
    "steep": (lambda x: np.exp(3 * x) - 5 * x, -2.0, 2.0),
    "kink": (lambda x: abs(x - 0.123), -1.0, 1.0),
    "at its end": (lambda x: x, 0.0, 1.0),
    "flat": (lambda x: (x - 1.7) ** 4, 0.0, 5.0),
    "cosine": (np.cos, 2.0, 5.0),
}


@pytest.mark.parametrize("name", FUNCTIONS)
def test_it_is_scipys(name):
    f, low, high = FUNCTIONS[name]
    asked = []
    found = minimum(lambda x: asked.append(x) or float(f(x)), low, high, 1e-7)
    peer = minimize_scalar(f, bounds=(low, high), method="bounded", options={"xatol": 1e-7})
    assert abs(found - peer.x) < (1e-2 if name == "flat" else 4e-7)  # there x^4 is below rounding
    assert len(asked) <= 1.5 * peer.nfev
    assert min(asked) > low
    assert max(asked) < high
