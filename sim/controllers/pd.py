"""PD with feedforward."""

from typing import final

from idbench.sim.controllers.controller import AbstractController, AbstractLaw, Error, Task
from idbench.sim.robot.motors import Array
from idbench.sim.settings import EachPositive, Number, Positive, per_joint, settings


@final
@settings
class PDFeedforward(AbstractController):
    """PD with feedforward: u = feedforward tau_nominal(q_ref) + M (w^2 e + 2 zeta w de/dt)."""

    bandwidth: EachPositive = (15.0,)
    """Natural frequency w of the loop [rad/s], of all joints or of each."""
    damping: Positive = 1.0
    """Damping ratio zeta of the loop."""
    feedforward: Number = 1.0
    """Share of the nominal robot's torque that is fed forward; 1.1 is a model whose inertias are 10 % too large."""
    cutoff: Positive = 100.0
    """First-order low-pass on de/dt [Hz]."""

    def start(self, task: Task) -> AbstractLaw:
        """Return the law, its gains for the inertia at the start of the motion."""
        return _Law(self, task)


class _Law(AbstractLaw):
    def __init__(self, settings: PDFeedforward, task: Task) -> None:
        w = per_joint(settings.bandwidth, task.nominal.n, "controller.bandwidth")
        self._kp, self._kd = task.inertia * w**2, task.inertia * 2 * settings.damping * w
        self._ahead = settings.feedforward * task.feedforward
        self._error = Error(task.reference, task.nsim, settings.cutoff)

    def command(self, k: int, q: Array) -> Array:
        e, rate = self._error.update(k, q)
        return self._ahead[k] + self._kp * e + self._kd * rate
