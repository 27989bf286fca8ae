"""Random waypoints, inside the joints' ranges and a fair move from their neighbours."""

import numpy as np

from idbench.sim.errors import ScenarioError
from idbench.sim.robot.motors import Array

DRAWS = 10000
"""Draws of all joints, and then of single ones, after which no waypoint is believed to exist."""


def draw_waypoint(
    rng: np.random.Generator, ranges: Array, neighbours: Array, clearance: Array | float, smallest_move: Array | float
) -> Array:
    """Return a random waypoint [rad], shape (joint,).

    Parameters
    ----------
    rng : numpy.random.Generator
    ranges : Array, shape (joint, 2)
        Lowest and highest position [rad].
    neighbours : Array, shape (any, joint)
        Waypoints before and after it; every joint moves at least `smallest_move` [rad] from and to them.
    clearance, smallest_move : float or Array, shape (joint,)
        Distance from the ends of the ranges, and of a move [rad], of all joints or of each.

    Raises
    ------
    ScenarioError
        If there is no such waypoint.
    """
    low, high = ranges[:, 0] + clearance, ranges[:, 1] - clearance
    if (low < high).all() and np.isfinite(ranges).all():
        point, far = np.zeros(len(ranges)), np.zeros(len(ranges), dtype=np.bool_)
        for k in range(2 * DRAWS):
            # All joints of a hand are seldom right in one draw: then those that are wrong are drawn again.
            point = np.where(far & (k > DRAWS), point, rng.uniform(low, high))
            far = np.asarray((np.abs(neighbours - point) >= smallest_move).all(axis=0))
            if far.all():
                return point
    narrow = int(np.argmin(high - low))
    raise ScenarioError(
        f"no waypoint is {np.max(smallest_move):g} rad from its neighbours and {np.max(clearance):g} rad inside the ranges of "
        f"{len(ranges)} joints, the narrowest {ranges[narrow, 0]:.4g} to {ranges[narrow, 1]:.4g}: lower smallest_move or "
        "clearance"
    )
