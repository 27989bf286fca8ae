"""A controller: which torques it commands, sample by sample, for many simulations at once."""

from idbench.sim.controllers import AbstractController, AbstractLaw, Error, Task
from idbench.sim.robot.motors import Array
from idbench.sim.settings import Positive, settings


@settings
class Starter(AbstractController):
    """PD with the nominal robot's torque fed forward, u = tau_nominal(q_ref) + M (w^2 e + 2 w de/dt)."""

    bandwidth: Positive = 15.0
    """Natural frequency w of the loop [rad/s]."""

    def start(self, task: Task) -> AbstractLaw:
        """Return the law at work on a task: the motion, the nominal robot, the number of simulations."""
        return _Law(self, task)


class _Law(AbstractLaw):
    def __init__(self, settings: Starter, task: Task) -> None:
        w, self._ahead = settings.bandwidth, task.feedforward
        self._kp, self._kd = task.inertia * w**2, task.inertia * 2 * w
        self._error = Error(task.reference, task.nsim, 100.0)  # de/dt by differences, low-passed at 100 Hz

    def command(self, k: int, q: Array) -> Array:
        e, rate = self._error.update(k, q)  # what is commanded depends on measured positions alone
        return self._ahead[k] + self._kp * e + self._kd * rate
