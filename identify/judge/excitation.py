"""Which moves show a parameter."""

from collections.abc import Iterator, Sequence
from functools import cache
from itertools import combinations

import numpy as np

from idbench.identify.arrays import Array
from idbench.identify.basis.basis import Basis
from idbench.identify.data.kinematics import KinematicTree
from idbench.identify.parameters.base_parameters import BaseParameters, columns_at, random_states
from idbench.identify.rows.factors import NOT_SHOWN

ENOUGH = 0.2
"""Share of what a parameter adds of its own to the torques while all joints move, from which some of them will do."""

MOST_JOINTS = 3
"""Joints of a move; what takes more of them counts as needing all."""

STATES = 200
"""Random states of a move."""


def showing_moves(tree: KinematicTree, grouping: BaseParameters, names: Sequence[str]) -> dict[str, tuple[int, ...]]:
    """Return for each base parameter the fewest joints that show it when they move, from 0; all where it takes many.

    Some joints move at random, the others rest. A parameter shows by what its column has that no combination of
    the others has.

    Parameters
    ----------
    tree : KinematicTree
        The robot.
    grouping : BaseParameters
        Its base parameters.
    names : sequence of str
        Some of them.
    """
    basis, states = grouping.basis, random_states(tree, STATES)

    @cache
    def shown(joints: tuple[int, ...]) -> Array:
        return _shown(basis, _only(states, joints))

    whole = shown(tuple(range(tree.n)))
    found = {}
    for name in names:
        i = basis.names.index(name)
        found[name] = next((joints for joints in _moves(tree.n) if shown(joints)[i] >= ENOUGH * whole[i]), tuple(range(tree.n)))
    return found


def brisk_shares(tree: KinematicTree, basis: Basis, X: Array, sigma: Array) -> Array:
    """Return how much of the torque of a brisk motion one sigma of each parameter makes, of the joint where it makes most.

    The motion is one of random states at up to 5 rad/s and 25 rad/s^2: what a log leaves open shows there, if anywhere.

    Parameters
    ----------
    tree : KinematicTree
        The robot.
    basis : Basis
        The base parameters that were identified.
    X, sigma : Array, shape (b,)
        Estimate and standard deviations.

    Returns
    -------
    Array, shape (b,)
        Rms of the column times sigma, over the rms of the torque.
    """
    W = columns_at(basis, random_states(tree, STATES))
    torque = np.sqrt(np.mean(np.einsum("jpt,p->jt", W, X) ** 2, axis=-1))
    parts = np.sqrt(np.mean(W**2, axis=-1)) * sigma
    return np.max(parts / np.maximum(torque, 1e-300)[:, None], axis=0)


def _moves(n: int) -> Iterator[tuple[int, ...]]:
    for count in range(1, min(MOST_JOINTS, n) + 1):
        yield from combinations(range(n), count)


def _only(states: Array, joints: Sequence[int]) -> Array:
    """Return the states with some joints moving and the others standing where they are first."""
    moving = np.zeros((states.shape[1], 1), dtype=bool)
    moving[list(joints)] = True
    return np.stack([np.where(moving, states[0], states[0, :, :1]), states[1] * moving, states[2] * moving])


def _shown(basis: Basis, states: Array) -> Array:
    """Return the length of each column off all others, shape (b,)."""
    W = columns_at(basis, states)
    _, values, directions = np.linalg.svd(np.moveaxis(W, 1, -1).reshape(-1, len(basis.names)), full_matrices=False)
    seen = values > NOT_SHOWN * values[0]
    hidden = np.sum(directions[~seen] ** 2, axis=0) > NOT_SHOWN
    spread = np.sqrt(np.sum((directions[seen] / values[seen][:, None]) ** 2, axis=0))
    return np.divide(1.0, spread, out=np.zeros(len(spread)), where=~hidden & (spread > 0))
