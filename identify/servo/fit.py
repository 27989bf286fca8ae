"""What was identified of a servo."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import final

import numpy as np

from idbench.identify.arrays import Array
from idbench.identify.servo.closed_loop import ServoLoop
from idbench.identify.servo.excitation import Excitation
from idbench.identify.servo.left_out import LeftOut, left_out, stretches
from idbench.identify.servo.run import ServoRun
from idbench.identify.servo.search import Found
from idbench.identify.servo.servo import Servo

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
    """Covariance of the free parameters, where it contains errors of other joints (see `idbench.identify.servo.together`),
    shape (p, p), optional."""

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
        free = rounded.free_of(J, np.ones(J.shape[:2])).reshape(-1, n)
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
