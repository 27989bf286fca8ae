"""Whether the torques of a log are far from what the robot's file says of the same motion, and what of the file that is."""

import numpy as np

from idbench.experiments.identification.fit import Fit
from idbench.identify import Problem
from idbench.identify.arrays import Array
from idbench.identify.basis.parameter import FRICTION, RIGID, Kind

FAR_OFF = 30.0
"""Factor between measured and expected torques that no missing rotor makes in the joint that carries most."""

PARTS: dict[str, frozenset[Kind]] = {"friction": FRICTION, "links and rotors": RIGID}
"""What of a file makes torques, and by which parameters."""


def unlike_file(fit: Fit) -> list[str]:
    """Return whether torques are far from what the robot's file says of the same motion, as those in other units are.

    If only friction is, or only what has inertia, that is said: the file has placeholders.
    """
    robot_model, R = fit.robot_model, without_shapes(fit.problem)
    if robot_model.robot.weightless:
        return []
    filed = np.array(list(robot_model.truth(robot_model.robot).values()))
    expected = np.linalg.norm(R[..., :-1] @ filed, axis=-1)
    j = int(np.argmax(expected))  # the joint of which the file expects most
    measured = float(np.linalg.norm(R[j, ..., -1]))
    if not expected[j] or not _far(measured / expected[j]):
        return []
    X = next(iter(fit.estimates.values())).X
    every = {part: _torques(fit, R[j, ..., :-1], kinds, X, filed) for part, kinds in PARTS.items()}
    ratios = {part: float(found / stated) for part, (found, stated) in every.items() if stated}
    words = f"the torques are {measured / expected[j]:.2g} times what the robot's file says of this motion"
    far = [part for part, ratio in ratios.items() if _far(ratio)]
    if len(far) == len(ratios):
        return [f"{words}: are they in N m?"]
    each = ", ".join(f"its {part} {ratio:.2g} times" for part, ratio in ratios.items())
    return [f"{words}, {each} at {robot_model.robot.joints[j]}: are the file's values of {' and '.join(far)} placeholders?"]


def without_shapes(problem: Problem) -> Array:
    """Return R of the measured torques: rows of laws that are linear about an estimate contain what that makes of these."""
    R = problem.factors.R.copy()
    for place, value in problem.basis.operating_point.items():
        R[..., -1] -= R[..., place] * value
        R[..., place] = 0.0
    return R


def _far(ratio: float) -> bool:
    return not 1 / FAR_OFF < ratio < FAR_OFF


def _torques(fit: Fit, R: Array, kinds: frozenset[Kind], X: Array, filed: Array) -> tuple[float, float]:
    """Return the size of the torques that some parameters make, as estimated and by the file."""
    chosen = np.array([parameter.kind in kinds for parameter in fit.basis.parameters])
    found, stated = (float(np.linalg.norm(R @ np.where(chosen, values, 0.0))) for values in (X, filed))
    return found, stated
