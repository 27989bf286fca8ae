"""Computed torque."""

from typing import final

from idbench.sim.controllers.controller import AbstractController, AbstractLaw, Error, Task
from idbench.sim.robot.motors import Array
from idbench.sim.settings import EachPositive, Number, Positive, per_joint, settings


@final
@settings
class ComputedTorque(AbstractController):
    """Computed torque: u = (1 + model_error) tau_nominal(q, qd, qdd_ref + w^2 e + 2 zeta w de/dt)."""

    bandwidth: EachPositive = (15.0,)
    """Natural frequency w of the loop [rad/s], of all joints or of each."""
    damping: Positive = 1.0
    """Damping ratio zeta of the loop."""
    model_error: Number = 0.0
    """Share by which all inertias and viscous frictions of the nominal model are wrong."""
    cutoff: Positive = 100.0
    """First-order low-pass on de/dt [Hz]."""

    def start(self, task: Task) -> AbstractLaw:
        """Return the law."""
        return _Law(self, task)


class _Law(AbstractLaw):
    def __init__(self, settings: ComputedTorque, task: Task) -> None:
        w = per_joint(settings.bandwidth, task.nominal.n, "controller.bandwidth")
        self._kp, self._kd, self._share = w**2, 2 * settings.damping * w, 1 + settings.model_error
        self._reference, self._model = task.reference, task.model
        self._error = Error(task.reference, task.nsim, settings.cutoff)

    def command(self, k: int, q: Array) -> Array:
        e, rate = self._error.update(k, q)
        qdd = self._reference.qdd[k] + self._kp * e + self._kd * rate
        return self._share * self._model(q, self._reference.qd[k] - rate, qdd)
