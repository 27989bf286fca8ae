"""What refuses a servo's parameters: values that cannot be, motions that commands do not explain, torques without a scale."""

from collections.abc import Mapping

import numpy as np

from identify.errors import ExcitationError, IdentificationError, SettingError
from identify.servo.fit import ServoFit
from identify.servo.parameters import SERVO_PARAMETERS
from identify.servo.search import Search

TORQUES = ("a", "b", "Ia", "Fs", "Fv", "Fst")
"""Parameters that scale together where no known load sets the scale."""

SCALED = 1.5
"""Factor on all of them."""

CONTRAST = 1.6
"""Times by which that, or its inverse, must make the objective larger: a model is never exact, and where a wrong scale adds
little to its errors, these set the scale. Joints whose scale was wrong, simulated ones, had 1.2 to 1.5; right ones, simulated
and real, 1.8 and more."""

UNEXPLAINED = 0.2
"""Typical residual, as a share of the range of the motion, from which on a fit explains nothing."""


class UnscaledError(ExcitationError):
    """Torques without a scale: the fit explains how the joint moves, but not by which torques.

    Parameters
    ----------
    message : str
        The message.
    fit : ServoFit
        The fit.
    """

    def __init__(self, message: str, fit: ServoFit) -> None:
        super().__init__(message)
        self.fit = fit


def require_explained(fit: ServoFit) -> None:
    """Raise IdentificationError if commands do not explain the motion."""
    if fit.scale > UNEXPLAINED * fit.excitation.range:
        raise IdentificationError(
            f"{fit.loop.runs[0].name}: commands explain the motion to {fit.scale:.2g} rad only, of {fit.excitation.range:.2g} "
            "rad: check kp, gain and counts of the servo, and that the joint moves freely"
        )


def require_scale(fit: ServoFit) -> None:
    """Raise UnscaledError if other torques explain the motion as well; those that are known stay as they are."""
    torques = [name for name in TORQUES if name in fit.free]
    if not torques:
        return
    search = Search(fit.loop, fit.free, fit.excitation.scales, 3 * fit.scale)
    factors = np.array([1.0, SCALED, 1 / SCALED])
    cost = search.cost(fit.loop.simulate({name: x * (factors if name in torques else 1.0) for name, x in fit.p.items()}))
    if cost[1:].min() < CONTRAST * cost[0]:
        raise UnscaledError(
            f"{fit.loop.runs[0].name}: torque constant, friction and armature scale together, because the known load is small "
            "beside them: add a known mass to the robot's file, or give one of them (--hold JOINT.a=0.5)",
            fit,
        )


def require_possible(held: Mapping[str, float]) -> None:
    """Raise SettingError if a value cannot be."""
    for name, x in held.items():
        parameter = SERVO_PARAMETERS[name]
        if not np.isfinite(x) or x < parameter.low or (parameter.relative and x <= 0):
            raise SettingError(
                f"{name} = {x:g} {parameter.unit} is impossible: {parameter.meaning} must be finite and not negative"
            )
