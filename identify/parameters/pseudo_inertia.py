"""The second moments of a link's mass: what decides whether it can exist."""

import numpy as np

from idbench.identify.arrays import Array
from idbench.identify.data.kinematics import INERTIAL


def pseudo_inertia(values: Array) -> Array:
    """Return the pseudo-inertia of a link's XX XY XZ YY YZ ZZ MX MY MZ M, shape (4, 4)."""
    xx, xy, xz, yy, yz, zz, *first, mass = values
    inertia = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    S = np.empty((4, 4))
    S[:3, :3] = np.trace(inertia) / 2 * np.eye(3) - inertia
    S[:3, 3] = S[3, :3] = first
    S[3, 3] = mass
    return S


def inertial(S: Array) -> Array:
    """Return XX XY XZ YY YZ ZZ MX MY MZ M of a pseudo-inertia, shape (10,)."""
    second = S[:3, :3]
    inertia = np.trace(second) * np.eye(3) - second
    return np.array([*inertia[np.triu_indices(3)], *S[:3, 3], S[3, 3]])


PSEUDO = np.array([pseudo_inertia(e) for e in np.eye(len(INERTIAL))])
"""What each inertial parameter adds to a pseudo-inertia, shape (10, 4, 4)."""
