"""Rows made stretch by stretch are those made at once, and columns that are replayed are those of the formulas."""

import numpy as np
import pytest
from builders import arm

from idbench.identify import CHAINS, MODELS
from idbench.identify.basis import tree_links
from idbench.identify.basis.replay import PIECE
from idbench.identify.estimators.problem import Problem
from idbench.identify.rows import rows
from idbench.identify.signals.signals import State
from idbench.sim.engine.run import ideal_log
from idbench.sim.trajectories import RandomMoves


@pytest.fixture(scope="module")
def two_links():
    made = arm("two_link")
    moves = RandomMoves(moves=8, durations=(0.8, 1.2), velocity=(2.0,), rest=0.3)
    return ideal_log(made.robot, moves.sample(made.robot, 250.0)), made.grouping.basis


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("chain", CHAINS)
def test_stretches_make_the_rows_of_the_whole_log(two_links, model, chain, monkeypatch):
    log, basis = two_links
    whole = Problem((log,), basis, MODELS.create(model), CHAINS.create(chain)).rows
    monkeypatch.setattr(rows, "BYTES", 1.0)  # as short as filters allow
    parts = Problem((log,), basis, MODELS.create(model), CHAINS.create(chain)).rows
    np.testing.assert_array_equal(parts.Y, whole.Y)
    scale = np.abs(whole.W).max(axis=0)
    assert np.abs(parts.W - whole.W).max() <= 1e-12 * scale.max()  # a matrix product may add in another order
    np.testing.assert_array_equal(parts.valid, whole.valid)


@pytest.mark.parametrize("function", ["explicit", "momentum", "remainder", "energy"])
@pytest.mark.parametrize("shape", [(1,), (3,), (2, PIECE - 1), (2, 3, PIECE // 2 + 1)])
def test_replayed_columns_are_the_formulas_of_numbers(function, shape, rng):
    tree = arm("puma560").tree
    q, qd, qdd = rng.normal(size=(3, *shape[:-1], tree.n, shape[-1]))
    state = State(q, qd, lambda _: qdd)
    found = getattr(tree_links.TreeLinks(tree), function)(state)
    plain = tree_links._formulas(tree, function, state)
    for key, column in found.items():
        np.testing.assert_allclose(column, np.broadcast_to(plain[key], shape), rtol=1e-12, atol=1e-12)
    zero = {key for key, column in plain.items() if not np.any(column)}
    assert plain.keys() - found.keys() <= zero


def test_stretches_of_a_motion_share_what_is_made_of_them_once():
    """Large things once for each key in turn; nothing is left when the motion is told to forget."""
    motion, made = State(np.zeros((2, 10)), np.ones((2, 10)), np.zeros_like), []

    def counted(state):
        made.append(state)
        return len(made)

    part, one, other = motion.part(slice(2, 5)), object(), object()
    assert motion.part(slice(2, 5)) is part
    assert part.qdd.shape == (2, 3)
    assert [part.latest(key, counted) for key in (one, one, other, one)] == [1, 1, 2, 3]
    motion.forget()
    assert motion.part(slice(2, 5)) is not part
