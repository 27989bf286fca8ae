"""Which move shows a parameter."""

from collections.abc import Sequence

import numpy as np

from identify.arrays import Array
from identify.base_parameters import STATES_A_PARAMETER, BaseParameters, random_states
from identify.basis import Basis
from identify.kinematics import KinematicTree
from identify.state import State

ENOUGH = 0.5
"""Joints are named until they show this share of what all of them together show."""


def showing_moves(tree: KinematicTree, grouping: BaseParameters, names: Sequence[str]) -> dict[str, tuple[int, ...]]:
    """Return for each base parameter the joints that must move to show it, the one that shows most first, from 0.

    A joint alone moves at random, while the others stand in random poses; what they show together counts as a whole. A
    parameter that shows at rest, by its weight, needs poses of the joints that turn it.

    Parameters
    ----------
    tree : KinematicTree
        The robot.
    grouping : BaseParameters
        Its base parameters.
    names : sequence of str
        Some of them.
    """
    basis = grouping.basis.renamed({name: name for name in names})
    states = random_states(tree, STATES_A_PARAMETER * len(grouping.names))
    alone = np.array([_shown(basis, _only(states, [j])) for j in range(tree.n)])
    whole = _shown(basis, states)
    found = {}
    for name in names:
        i = basis.parameters.index(name)
        order = np.argsort(-alone[:, i], kind="stable")
        joints: list[int] = []
        for j in order:
            joints.append(int(j))
            if _shown(basis, _only(states, joints))[i] >= ENOUGH * whole[i]:
                break
        found[name] = tuple(joints)
    return found


def _only(states: Array, joints: Sequence[int]) -> Array:
    """Return the states with some joints moving and the others standing where they are."""
    moving = np.zeros(states.shape[1], dtype=bool)
    moving[list(joints)] = True
    return np.stack([states[0], states[1] * moving[:, None], states[2] * moving[:, None]])


def _shown(basis: Basis, states: Array) -> Array:
    """Return how much the columns of each parameter vary, shape (b,)."""
    q, qd, qdd = states
    squares = np.zeros(len(basis.parameters))
    for (_, name), column in basis.explicit(State(q, qd, lambda _: qdd)).items():
        squares[basis.parameters.index(name)] += np.var(column)
    return np.sqrt(squares)
