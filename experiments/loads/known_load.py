"""What is known of a payload, as options say it."""

from collections.abc import Sequence
from math import isfinite

import numpy as np

from experiments.errors import ExperimentError
from identify.loads.loaded_robot import LETTERS


def known_of(mass: float | None, at: Sequence[float] | None, inertia: Sequence[float] | None) -> dict[str, float]:
    """Return the parameters of a payload that follow from its mass, centre of mass and inertia about that.

    Raises
    ------
    ExperimentError
        If a value is not finite, the mass is not above 0, or something is given without what it needs.
    """
    for name, needs, given in (("--at", "--mass", at), ("--inertia", "--at", inertia)):
        if given is not None and (mass is None or (name == "--inertia" and at is None)):
            raise ExperimentError(f"{name} needs {needs}: moments are of a mass that is known")
    values = [x for x in (mass, *(at or ()), *(inertia or ())) if x is not None]
    if not all(map(isfinite, values)) or (mass is not None and not mass > 0):
        raise ExperimentError(f"mass, place and inertia of the payload must be finite, the mass above 0: {values}")
    found = {} if mass is None else {"ML": float(mass)}
    if mass is not None and at is not None:
        found |= {f"M{x}L": mass * c for x, c in zip("XYZ", at, strict=True)}
        if inertia is not None:
            xx, yy, zz, xy, xz, yz = inertia
            c = np.array(at)
            about = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]) + mass * (c @ c * np.eye(3) - np.outer(c, c))
            found |= dict(zip(LETTERS[:6], map(float, about[np.triu_indices(3)]), strict=True))
    return found
