"""What is taken where nothing else is asked for."""

import numpy as np

from idbench.experiments.requests.shared import CHAIN, ESTIMATOR
from idbench.identify import CHAINS, ESTIMATORS, MODELS, identify, scara


def test_the_command_lines_defaults_are_those_of_python(log):
    """To the bit: another estimator, or another chain, gives other parameters."""
    model = MODELS.create("explicit")
    named = identify(log, scara(), model, CHAINS.create(CHAIN), ESTIMATORS.create(ESTIMATOR))
    np.testing.assert_array_equal(identify(log, scara(), model).X, named.X)
