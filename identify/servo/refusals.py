"""What refuses a servo's parameters: values that cannot be, motions that commands do not explain, torques without a scale."""

from collections.abc import Mapping
from typing import Self

import numpy as np

from idbench.identify.errors import ExcitationError, IdentificationError, SettingError
from idbench.identify.servo.fit import ServoFit
from idbench.identify.servo.parameters import SERVO_PARAMETERS

TORQUES = ("a", "b", "Ia", "Fs", "Fv", "Fst", "Fo")
"""Parameters that scale together where no known load sets the scale."""

OTHER_SCALE = 1.5
"""Factor on the torque per volt."""

MIN_RISE = 16.0
"""By how much another scale must make the objective larger, in means over the parts of the log: four standard errors, if a
part counts as one observation. Simulated joints whose scale was wrong had 0 to 14, those with a mass that sets it 26 and more;
the public bench had 5 to 31 from single runs, 23 from a hundred."""

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

    def __reduce__(self) -> tuple[type[Self], tuple[str, ServoFit]]:
        """Keep the fit when the error comes from another process."""
        return type(self), (str(self), self.fit)


def require_explained(fit: ServoFit) -> None:
    """Raise IdentificationError if commands do not explain the motion."""
    if fit.scale > UNEXPLAINED * fit.excitation.range:
        raise IdentificationError(
            f"{fit.loop.runs[0].name}: commands explain the motion to {fit.scale:.2g} rad only, of {fit.excitation.range:.2g} "
            "rad: check kp, gain and counts of the servo, and that the joint moves freely"
        )


def has_scale(fit: ServoFit) -> bool:
    """Return whether other torques explain the motion less well."""
    return fit.parts * (fit.contrast - 1) >= MIN_RISE


def require_scale(fit: ServoFit) -> None:
    """Raise UnscaledError if other torques explain the motion as well."""
    if not has_scale(fit):
        why = "gravity is free as well (Mg)" if "Mg" in fit.free else "the known load is small beside them"
        raise UnscaledError(
            f"{fit.loop.runs[0].name}: torque constant, friction and armature scale together, because {why}: add a known mass "
            "to the robot's file, log more motion, or give one of them (--hold JOINT.a=0.5)",
            fit,
        )


def require_possible(held: Mapping[str, float]) -> None:
    """Raise SettingError if a value cannot be."""
    for name, x in held.items():
        parameter = SERVO_PARAMETERS[name]
        if not np.isfinite(x) or not parameter.low <= x <= parameter.high or (parameter.relative and x <= 0):
            limits = ["finite", "above 0"] if parameter.relative else ["finite"]
            limits += [f"at least {parameter.low:.4g}"] if np.isfinite(parameter.low) and not parameter.relative else []
            limits += [f"at most {parameter.high:.4g}"] if np.isfinite(parameter.high) else []
            raise SettingError(
                f"{name} = {x:g} {parameter.unit} is impossible: {parameter.meaning} must be {', '.join(limits)}"
            )
