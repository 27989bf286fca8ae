"""PID, without a model of the robot."""

from typing import final

import numpy as np

from idbench.sim.controllers.controller import AbstractController, AbstractLaw, Error, Task
from idbench.sim.robot.motors import Array
from idbench.sim.settings import EachPositive, Positive, per_joint, settings


@final
@settings
class PID(AbstractController):
    """PID: u = M (3 w^2 e + 3 w de/dt + w^3 int e), all poles at -w for a constant inertia."""

    bandwidth: EachPositive = (15.0,)
    """Triple pole w of the loop [rad/s], of all joints or of each."""
    cutoff: Positive = 100.0
    """First-order low-pass on de/dt [Hz]."""

    def start(self, task: Task) -> AbstractLaw:
        """Return the law, its gains for the inertia at the start of the motion."""
        return _Law(self, task)


class _Law(AbstractLaw):
    def __init__(self, settings: PID, task: Task) -> None:
        w, M = per_joint(settings.bandwidth, task.nominal.n, "controller.bandwidth"), task.inertia
        self._kp, self._kd, self._ki = 3 * M * w**2, 3 * M * w, M * w**3 / task.reference.fs
        self._sum = np.zeros((task.nsim, task.nominal.n))
        self._error = Error(task.reference, task.nsim, settings.cutoff)
        # What holds the arm at rest, which the integrator would have found before the motion begins.
        self._hold = task.feedforward[0]

    def command(self, k: int, q: Array) -> Array:
        e, rate = self._error.update(k, q)
        self._sum = self._sum + e
        return self._hold + self._kp * e + self._kd * rate + self._ki * self._sum
