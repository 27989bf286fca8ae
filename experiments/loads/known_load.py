"""What is known of a payload, as options say it."""

from collections.abc import Sequence

import numpy as np

from idbench.experiments.errors import ExperimentError
from idbench.identify.loads.loaded_robot import LETTERS

HEAVIEST = 1e5
FARTHEST = 1e3
ROUNDING = 1e-9
"""Mass [kg] and distance [m] beyond which no gripper holds anything, and a share of rounding."""


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
    if mass is not None and not 0 < mass <= HEAVIEST:
        raise ExperimentError(f"--mass {mass:g} must be above 0 and at most {HEAVIEST:g} kg")
    if wrong := [x for x in at or () if not abs(x) <= FARTHEST]:
        raise ExperimentError(
            f"--at {wrong[0]:g}: the centre of mass must lie within {FARTHEST:g} m of the frame of the last link"
        )
    if inertia is not None:
        xx, yy, zz, xy, xz, yz = inertia
        about = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        moments = np.linalg.eigvalsh(about) if np.isfinite(about).all() else np.array([np.nan])
        if not (
            moments[0] >= 0 and 2 * moments[-1] <= moments.sum() * (1 + ROUNDING) and moments[-1] <= HEAVIEST * FARTHEST**2
        ):
            raise ExperimentError(
                f"--inertia {' '.join(f'{x:g}' for x in inertia)} is of no body: its principal moments must be 0 or above, "
                "and none larger than the sum of the others"
            )
    found = {} if mass is None else {"ML": float(mass)}
    if mass is not None and at is not None:
        found |= {f"M{x}L": mass * c for x, c in zip("XYZ", at, strict=True)}
        if inertia is not None:
            xx, yy, zz, xy, xz, yz = inertia
            c = np.array(at)
            about = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]) + mass * (c @ c * np.eye(3) - np.outer(c, c))
            found |= dict(zip(LETTERS[:6], map(float, about[np.triu_indices(3)]), strict=True))
    return found
