"""What was identified of a servo."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import numpy.typing as npt

from idbench.identify.arrays import Array
from idbench.identify.errors import SettingError
from idbench.identify.servo.closed_loop import STATES, ServoLoop, initial_state
from idbench.identify.servo.excitation import Excitation
from idbench.identify.servo.law import Servo
from idbench.identify.servo.left_out import LeftOut, cross_validate, stretches
from idbench.identify.servo.parameters import SERVO_PARAMETERS
from idbench.identify.servo.run import ServoRun, part_of
from idbench.identify.servo.search import Found

CLUSTERS = 2  # Clusters per parameter: where there are fewer runs, or pieces of them, these are cut into stretches of time


MIN_PARTS = 24  # Parts of a log by which scales are compared, at least, whatever the number of parameters


@dataclass(frozen=True, eq=False)
class ServoFit:
    """What was identified of a servo."""

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
    contrasts: tuple[float, float]
    """How many times larger the objective is with two thirds, and with half as much again, of the torque per volt, and with all
    others as that needs them: near 1 where no known load sets the scale of the torques."""
    of_all: Array | None = None
    """Covariance of the free parameters, where it contains errors of other joints (see `together`), shape (p, p)."""

    @property
    def servo(self) -> Servo:
        """What is known of the loop, in the first run."""
        return self.loop.runs[0].servo

    @property
    def taken_late(self) -> float:
        """What the integrator of a simulation takes late of the damping, h D [kg m^2]; 0 of a real joint."""
        servo = self.servo
        loop = self.p["a"] * servo.supply * (servo.kd + servo.slope * self.p.get("lead", 0.0)) + self.p["b"]
        return 2 * (max(servo.steps.joint, 0.0) * self.p["Fv"] + max(servo.steps.loop, 0.0) * loop)

    @property
    def p(self) -> dict[str, float]:
        """All parameters, in SI units."""
        return self.found.p

    @cached_property
    def left_out(self) -> LeftOut:
        """The fit without each run, or piece of a run."""
        parts = stretches(self.found, self.loop, CLUSTERS * len(self.free))
        return cross_validate(self.found, self.loop, 3 * self.scale, parts)

    @property
    def scaled(self) -> bool:
        """Whether other torques explain the motion less well: if not, all torques are known up to a common factor."""
        return self.parts * (min(self.contrasts) - 1) >= MIN_RISE

    @property
    def factor(self) -> tuple[float, float]:
        """By how much all torques may be smaller and larger at once: two standard errors of a parabola over its logarithm."""
        rises = [max(self.parts * (contrast - 1) / SIGMAS**2, LEAST_RISE) for contrast in self.contrasts]
        low, high = (OTHER_SCALE ** (sign / np.sqrt(rise)) for sign, rise in zip((-1, 1), rises, strict=True))
        return float(low), float(high)

    @property
    def known(self) -> frozenset[str]:
        """Parameters that were not searched for."""
        return frozenset(self.p) - set(self.free) - ({"a"} if not self.excitation.loaded else set())

    @cached_property
    def unscaled(self) -> frozenset[str]:
        """Parameters that lack the scale of torques: torques, known up to a common factor, and an offset, found by gravity."""
        if self.scaled:
            return frozenset()
        return frozenset({*TORQUES} & {*self.p} - self.known | {"offset"} & {*self.free})

    @property
    def offset(self) -> float:
        """Angle of the file minus angle of the log [rad], 0 where torques have no scale to find it by."""
        return 0.0 if "offset" in self.unscaled else self.p["offset"]

    @property
    def explained(self) -> bool:
        """Whether commands explain the motion."""
        return self.scale <= UNEXPLAINED * self.excitation.range

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
        free = replace(self.found.beginnings, P=1.0).without(J).reshape(-1, n)
        J = J.reshape(-1, n)
        size = np.sqrt((J**2).sum(axis=0))
        size = np.where(size > 0, size, 1.0)
        inverse = np.linalg.pinv((free / size).T @ (J / size))
        sigma = self.loop.step / np.sqrt(12) * np.sqrt(np.maximum(np.diagonal(inverse), 0.0)) / size
        return dict(zip(self.free, sigma.tolist(), strict=True))

    @property
    def scale(self) -> float:
        """Typical size of a residual [rad]."""
        return max(float(np.median(np.abs(self.found.residual[self.loop.kept]))), self.loop.step / 4)

    def simulate(self, runs: Sequence[ServoRun]) -> list[Array]:
        """Positions of runs from their commands alone [rad], at their samples, without the encoder's rounding."""
        q = ServoLoop(runs, self.loop.h).simulate(self.p)[0]
        return [x[: len(run.t)] for x, run in zip(q, runs, strict=True)]

    def fine(self, run: ServoRun) -> tuple[Array, Array]:
        """Steps of a simulation [s], on the clock of a run, and its positions from its commands alone [rad]."""
        t = np.arange(run.t[0], run.t[-1], self.loop.h)
        place = np.searchsorted(run.t, t + 1e-9, side="right") - 1
        return t, self.simulate([part_of(run, place, t=t, q=np.interp(t, run.t, run.clean))])[0]

    def errors(self, runs: Sequence[ServoRun]) -> Array:
        """Mean absolute error of each run's position, simulated from its commands alone [rad], without spikes.

        Of a run that begins in motion, the time is left out over which its unknown beginning matters.
        """
        every = zip(runs, self.simulate(runs), self.follows(runs), strict=True)
        return np.array([np.abs(run.q - q)[run.read_well & follows].mean() for run, q, follows in every])

    def follows(self, runs: Sequence[ServoRun]) -> list[npt.NDArray[np.bool_]]:
        """Samples of each run at which another beginning, within what is known of it, would change nothing.

        That is another speed, by a count, and a target that is where the joint is. If it changes the second half of a run, too,
        as where nothing holds the joint, all samples are returned.
        """
        loop = ServoLoop(runs, self.loop.h)
        ahead = np.zeros((len(runs), STATES))
        for other, run, begin in zip(ahead, runs, map(initial_state, runs), strict=True):
            if begin.per_angle[-1] > 0:
                other[1:] = run.still, (begin.state[0] - run.command[0]) / begin.per_angle[-1]
        apart = np.abs(loop.simulate(self.p)[0] - loop.simulate(self.p, ahead)[0])
        moved = [one[: len(run.t)] > run.still for one, run in zip(apart, runs, strict=True)]
        ends = [int(np.flatnonzero(x)[-1]) + 1 if x.any() else 0 for x in moved]
        return [np.arange(len(x)) >= (end if end <= len(x) // 2 else 0) for x, end in zip(moved, ends, strict=True)]


TORQUES = ("a", "b", "Ia", "Fs", "Fv", "Fst", "Fo")  # Parameters that scale together where no known load sets the scale
OTHER_SCALE = 1.5  # Factor on the torque per volt

MIN_RISE = 16.0
"""By how much another scale must make the objective larger, in means over the parts of the log: four standard errors, if a
part counts as one observation. Simulated joints whose scale was wrong had 0 to 14, those with a mass that sets it 26 and more;
the public bench had 5 to 31 from single runs, 23 from a hundred."""

SIGMAS = 2.0  # Standard errors that a range of the common factor has
LEAST_RISE = 0.01  # Rise below which nothing is known of the factor: it is then stated as 1/60 to 60
UNEXPLAINED = 0.2  # Typical residual, as a share of the range of the motion, from which on a fit explains nothing


def require_possible(held: Mapping[str, float]) -> None:
    """Raise SettingError if a value cannot be."""
    for name, x in held.items():
        of = SERVO_PARAMETERS[name]
        if not np.isfinite(x) or not of.low <= x <= of.high or (of.relative and x <= 0):
            limits = ["finite", "above 0"] if of.relative else ["finite"]
            limits += [f"at least {of.low:.4g}"] if np.isfinite(of.low) and not of.relative else []
            limits += [f"at most {of.high:.4g}"] if np.isfinite(of.high) else []
            raise SettingError(f"{name} = {x:g} {of.unit} is impossible: {of.meaning} must be {', '.join(limits)}")
