"""Controllers, and their table."""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np
import numpy.typing as npt

from idbench.identify.plugins import PluginTable
from idbench.sim.drives.drive import Commanded, every
from idbench.sim.robot.inverse_dynamics import InverseDynamics, inverse_dynamics
from idbench.sim.robot.motors import Array
from idbench.sim.robot.robot import Robot
from idbench.sim.settings import EachPositive, Number, Positive, per_joint, settings
from idbench.sim.trajectories import Reference


@dataclass(frozen=True, eq=False)
class Task:
    """What a controller knows when it starts."""

    nominal: Robot
    """The robot as its maker describes it: without payload, with the friction of its MJCF."""
    reference: Reference
    """The planned motion at the sample rate, of all simulations or of each."""
    nsim: int
    """Number of simulations."""
    vary: Mapping[str, npt.ArrayLike] = field(default_factory=dict)
    """Fields of MuJoCo's model of a nominal robot that is another one in each simulation, shape (nsim, ...)."""

    @property
    def model(self) -> InverseDynamics:
        """The nominal robot of every simulation."""
        return InverseDynamics(self.nominal, self.nsim, self.vary)

    @property
    def inertia(self) -> Array:
        """Inertia that each joint's motor sees when the motion starts [kg m^2], shape (1 or nsim, joint)."""
        at = np.atleast_2d(self.reference.q[0])
        if self.vary:
            return self.model.inertia(at + np.zeros((self.nsim, 1)))
        return InverseDynamics(self.nominal, len(at)).inertia(at)

    @property
    def feedforward(self) -> Array:
        """Torque of the nominal robot along the planned motion, without Coulomb friction [N m].

        Of the shape of the motion, or (time, nsim, joint) if the nominal robot differs.
        """
        planned = self.reference
        if self.vary:
            model, shape = self.model, (len(planned.q), self.nsim, self.nominal.n)
            every = (np.broadcast_to(x if x.ndim == 3 else x[:, None], shape) for x in (planned.q, planned.qd, planned.qdd))
            return np.stack([model(*state) for state in zip(*every, strict=True)])
        q, qd, qdd = (x.reshape(-1, self.nominal.n) for x in (planned.q, planned.qd, planned.qdd))
        return inverse_dynamics(self.nominal, q, qd, qdd).reshape(planned.q.shape)


class AbstractLaw(ABC):
    """A controller at work; what it remembers between samples is of shape (nsim, joint)."""

    @abstractmethod
    def command(self, k: int, q: Array) -> Array:
        """Return the command, shape (nsim, joint), for the positions `q` [rad] of sample `k`; asked once a sample.

        Torques [N m], or positions [rad] of a controller that commands positions.
        """


class AbstractController(ABC):
    """The settings of a control law."""

    commanded: ClassVar[Commanded] = "torque"
    """What it commands."""

    @abstractmethod
    def start(self, task: Task) -> AbstractLaw:
        """Return the law at the start of a motion."""

    @property
    def wdyn(self) -> float | None:
        """Bandwidth of the position loop of the fastest joint, w_dyn [rad/s]; None if the controller closes no such loop."""
        return None


class AbstractClosedLoop(AbstractController):
    """A control law that closes a position loop around every joint."""

    bandwidth: tuple[float, ...]

    @property
    def wdyn(self) -> float | None:
        """Natural frequency of the fastest joint [rad/s]."""
        return max(self.bandwidth)


class Error:
    """Control error e = q_ref - q and its difference quotient, behind a first-order low-pass of `cutoff` [Hz]."""

    def __init__(self, reference: Reference, nsim: int, cutoff: float) -> None:
        self._reference = reference
        self._share = 1 - np.exp(-2 * np.pi * cutoff / reference.fs)
        self._before: Array | None = None
        self._rate = np.zeros((nsim, reference.q.shape[-1]))

    def update(self, k: int, q: Array) -> tuple[Array, Array]:
        """Return e [rad] and its rate [rad/s] at sample `k`."""
        e = self._reference.q[k] - q
        if self._before is not None:
            self._rate = self._rate + self._share * ((e - self._before) * self._reference.fs - self._rate)
        self._before = e
        return e, self._rate


@settings
class PDFeedforward(AbstractClosedLoop):
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
        return _PDLaw(self, task)


class _PDLaw(AbstractLaw):
    def __init__(self, settings: PDFeedforward, task: Task) -> None:
        w = per_joint(settings.bandwidth, task.nominal.n, "controller.bandwidth")
        self._kp, self._kd = task.inertia * w**2, task.inertia * 2 * settings.damping * w
        self._ahead = settings.feedforward * task.feedforward
        self._error = Error(task.reference, task.nsim, settings.cutoff)

    def command(self, k: int, q: Array) -> Array:
        e, rate = self._error.update(k, q)
        return self._ahead[k] + self._kp * e + self._kd * rate


@settings
class PID(AbstractClosedLoop):
    """PID: u = M (3 w^2 e + 3 w de/dt + w^3 int e), all poles at -w for a constant inertia."""

    bandwidth: EachPositive = (15.0,)
    """Triple pole w of the loop [rad/s], of all joints or of each."""
    cutoff: Positive = 100.0
    """First-order low-pass on de/dt [Hz]."""

    def start(self, task: Task) -> AbstractLaw:
        """Return the law, its gains for the inertia at the start of the motion."""
        return _PIDLaw(self, task)


class _PIDLaw(AbstractLaw):
    def __init__(self, settings: PID, task: Task) -> None:
        w, M = per_joint(settings.bandwidth, task.nominal.n, "controller.bandwidth"), task.inertia
        self._kp = 3 * M * w**2
        self._kd = 3 * M * w
        self._ki = M * w**3 / task.reference.fs
        self._sum = np.zeros((task.nsim, task.nominal.n))
        self._error = Error(task.reference, task.nsim, settings.cutoff)
        # What holds the arm at rest, which the integrator would have found before the motion begins.
        self._hold = task.feedforward[0]

    def command(self, k: int, q: Array) -> Array:
        e, rate = self._error.update(k, q)
        self._sum = self._sum + e
        return self._hold + self._kp * e + self._kd * rate + self._ki * self._sum


@settings
class ComputedTorque(AbstractClosedLoop):
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
        return _ComputedTorqueLaw(self, task)


class _ComputedTorqueLaw(AbstractLaw):
    def __init__(self, settings: ComputedTorque, task: Task) -> None:
        w = per_joint(settings.bandwidth, task.nominal.n, "controller.bandwidth")
        self._kp = w**2
        self._kd = 2 * settings.damping * w
        self._share = 1 + settings.model_error
        self._reference, self._model = task.reference, task.model
        self._error = Error(task.reference, task.nsim, settings.cutoff)

    def command(self, k: int, q: Array) -> Array:
        e, rate = self._error.update(k, q)
        qdd = self._reference.qdd[k] + self._kp * e + self._kd * rate
        return self._share * self._model(q, self._reference.qd[k] - rate, qdd)


@settings
class PositionCommand(AbstractController):
    """The planned positions, sent to servos."""

    commanded: ClassVar[Commanded] = "position"

    def start(self, task: Task) -> AbstractLaw:
        """Return the commands of a motion."""
        return _PositionLaw(task)


class _PositionLaw(AbstractLaw):
    def __init__(self, task: Task) -> None:
        planned = task.reference.q
        self._planned = planned if planned.ndim == 3 else [every(q, task.nsim) for q in planned]

    def command(self, k: int, q: Array) -> Array:
        return self._planned[k]


CONTROLLERS: PluginTable[AbstractController] = PluginTable(
    "controllers",
    AbstractController,  # type: ignore[type-abstract]  # only asked whether an instance is one
    {"pd": PDFeedforward, "pid": PID, "computed_torque": ComputedTorque, "position": PositionCommand},
)
