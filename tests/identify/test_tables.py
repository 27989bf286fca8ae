"""Values with their standard errors in the last digits."""

import numpy as np
import pytest

from idbench.identify.tables import concise


@pytest.mark.parametrize(
    ("x", "sigma", "text"),
    [
        (0.48878, 0.0033, "0.4888(33)"),
        (-0.3, 1.2, "-0.3(1.2)"),
        (99.96, 0.0996, "99.96(10)"),
        (0.00099996, 1e-5, "0.001000(10)"),
        (123.4, 12.0, "123(12)"),
        (1234567.0, 1000.0, "1234600(1000)"),
        (1e299, 1e298, "1.00(10)e+299"),
        (0.2, 1e15, "0.0(1.0)e+15"),
        (1e10, 1e-10, "1e+10"),
        (1.0, 0.0, "1"),
        (1.0, 5e-324, "1"),
        (1.0, np.inf, "1(?)"),
        (np.nan, 1.0, "nan(?)"),
    ],
)
def test_odd_values(x, sigma, text):
    assert concise(x, sigma) == text


def test_what_is_written_is_the_value_to_a_twentieth_of_its_error(rng):
    for x, sigma in zip(rng.normal(size=300) * 10 ** rng.uniform(-9, 9, 300), 10 ** rng.uniform(-9, 9, 300), strict=True):
        head, _, rest = concise(float(x), float(sigma)).partition("(")
        if not rest:  # far more digits than anybody writes
            assert sigma < 1e-12 * abs(x)
            continue
        error, _, power = rest.partition(")")
        scale = 10.0 ** float(power.removeprefix("e") or 0)
        places = 0 if "." in error else len(head.partition(".")[2])
        assert abs(float(head) * scale - x) <= 0.051 * sigma + 1e-12 * abs(x)
        assert float(error) * 10.0**-places * scale == pytest.approx(sigma, rel=0.051)
