"""What residuals have of the motion, and what of them is noise."""

import numpy as np
import pytest
import scipy.signal
from builders import closed

from idbench.identify import MODELS, BaseParameters, Problem, idbench_chain, tree_basis
from idbench.identify.judge.motion_share import FAINT, motion_shares, something_else
from idbench.sim.robot.robot import Robot
from idbench.sim.robot.tree import kinematic_tree


@pytest.fixture(scope="module")
def shares():
    """Returns what is found of a log with a torque more, f(q, qd, t, noise)."""
    scenario, log = closed(18)
    tree = kinematic_tree(Robot.load(scenario.robot))
    basis = BaseParameters.of(tree, tree_basis(tree)).basis
    qd, t = np.gradient(log.q, 1 / log.fs, axis=0), log.t

    def found(f, seed=0):
        more = f(log.q, qd, t, np.random.default_rng(seed).standard_normal(log.q.shape))
        changed = Problem((log,), basis, MODELS.create("explicit"), idbench_chain())
        changed = changed.with_logs([type(log)(log.fs, log.q, log.tau + more, log.torque)])
        return motion_shares(changed, changed.factors.fit(2).X)

    return found


def coloured(noise):
    """Return noise of the first order, correlated over 0.2 s, of rms 1."""
    a = np.exp(-1 / (100 * 0.2))
    return scipy.signal.lfilter([np.sqrt(1 - a**2)], [1, -a], noise, axis=0)


@pytest.mark.parametrize("seed", range(6))
def test_noise_is_no_function_of_the_motion_white_or_coloured(shares, seed):
    for f in (lambda q, qd, t, noise: 0.3 * noise, lambda q, qd, t, noise: 0.3 * coloured(noise)):
        found = shares(f, seed)
        assert all(one.share <= FAINT for one in found)
        assert all(one.noise == one.rms for one in found)
        assert list(something_else(found)) == []


@pytest.mark.parametrize(
    ("variable", "f"),
    [
        ("velocity", lambda q, qd, t, noise: np.exp(-((qd / 0.5) ** 2)) * [0, 0.3]),
        ("position", lambda q, qd, t, noise: np.sin(3 * q) * [0, 0.3]),
        ("other joints", lambda q, qd, t, noise: np.gradient(qd, 0.01, axis=0)[:, ::-1] * [0, 0.1]),
        ("moment", lambda q, qd, t, noise: ((t > 8) & (t < 8.5))[:, None] * [0, 2.0]),
    ],
)
def test_what_depends_on_the_motion_is_told_from_noise_by_its_variable(shares, variable, f):
    found = shares(lambda q, qd, t, noise: f(q, qd, t, noise) + 0.02 * noise)
    (one,) = something_else(found)
    assert (one.joint, one.of) == (1, variable)
    assert found[0].share <= FAINT
