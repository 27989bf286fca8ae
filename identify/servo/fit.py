"""What was identified of a servo."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Self, final

import numpy as np

from idbench.identify.arrays import Array
from idbench.identify.errors import ExcitationError, IdentificationError, SettingError
from idbench.identify.servo.closed_loop import Servo, ServoLoop
from idbench.identify.servo.excitation import Excitation
from idbench.identify.servo.left_out import LeftOut, left_out, stretches
from idbench.identify.servo.parameters import SERVO_PARAMETERS
from idbench.identify.servo.run import ServoRun
from idbench.identify.servo.search import Found

CLUSTERS = 2
"""Clusters per parameter: where there are fewer runs, or pieces of them, these are cut into stretches of time."""


MIN_PARTS = 24
"""Parts of a log by which scales are compared, at least, whatever the number of parameters."""


@final
@dataclass(frozen=True, eq=False)
class ServoFit:
    """What was identified of a servo."""

    servo: Servo
    """What was known."""
    friction: str
    """Law of friction."""
    free: tuple[str, ...]
    """Parameters that were searched for."""
    found: Found
    """The search's result."""
    loop: ServoLoop
    """The runs that it looked at."""
    excitation: Excitation
    """What the runs can show."""
    contrast: float
    """How many times larger the objective is at least with half as much again, or two thirds, of the torque per volt, and with
    all others as that needs them: near 1 where no known load sets the scale of the torques."""
    of_all: Array | None = None
    """Covariance of the free parameters, where it contains errors of other joints (see `together`), shape (p, p)."""

    @property
    def p(self) -> dict[str, float]:
        """All parameters, in SI units."""
        return self.found.p

    @cached_property
    def left_out(self) -> LeftOut:
        """The fit without each run, or piece of a run."""
        return left_out(self.found, self.loop, 3 * self.scale, stretches(self.found, self.loop, CLUSTERS * len(self.free)))

    @property
    def parts(self) -> int:
        """Runs, or parts of them, by which scales are compared."""
        return stretches(self.found, self.loop, MIN_PARTS) * len(self.loop.runs)

    @property
    def covariance(self) -> Array:
        """Of the free parameters, from the scatter of the residuals, shape (p, p)."""
        return self.left_out.covariance if self.of_all is None else self.of_all

    @property
    def standard_errors(self) -> dict[str, float]:
        """Of the free parameters."""
        return dict(zip(self.free, np.sqrt(np.diagonal(self.covariance)).tolist(), strict=True))

    @cached_property
    def bound(self) -> dict[str, float]:
        """Standard errors that the rounding of the encoder alone leaves (Cramer-Rao)."""
        J, n = self.found.sensitivity, len(self.free)
        rounded = replace(self.found.beginning, certainty=1.0)
        free = rounded.weighted(np.ones(J.shape[:2])).without(J).reshape(-1, n)
        J = J.reshape(-1, n)
        size = np.sqrt((J**2).sum(axis=0))
        size = np.where(size > 0, size, 1.0)
        inverse = np.linalg.pinv((free / size).T @ (J / size))
        return dict(
            zip(self.free, (self.servo.step / np.sqrt(12) * np.sqrt(np.diagonal(inverse)) / size).tolist(), strict=True)
        )

    @property
    def scale(self) -> float:
        """Typical size of a residual [rad]."""
        return max(float(np.median(np.abs(self.found.residual[self.loop.kept]))), self.servo.step / 4)

    def simulate(self, runs: Sequence[ServoRun]) -> list[Array]:
        """Return the positions of runs from their commands alone [rad], at their samples, without the encoder's rounding."""
        q = ServoLoop(self.servo, runs, self.loop.h).simulate(self.p)[0]
        return [x[: len(run.t)] for x, run in zip(q, runs, strict=True)]

    def errors(self, runs: Sequence[ServoRun]) -> Array:
        """Return the mean absolute error of each run's position, simulated from its commands alone [rad], without spikes."""
        every = zip(runs, self.simulate(runs), strict=True)
        return np.array([np.abs(run.q - q)[run.read_well].mean() for run, q in every])


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
