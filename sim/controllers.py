"""Controllers, and their table."""

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import ClassVar

import mujoco
import numpy as np
import numpy.typing as npt

from idbench.identify.compiled import pointer
from idbench.identify.plugins import PluginTable
from idbench.sim.drives.drive import Commanded
from idbench.sim.part import AbstractCompiledPart, Addresses, mujoco_function
from idbench.sim.robot.inverse_dynamics import InverseDynamics, inverse_dynamics
from idbench.sim.robot.motors import Array
from idbench.sim.robot.robot import Robot
from idbench.sim.robot.varied import varied_models
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

    @cached_property
    def inertia(self) -> Array:
        """Inertia that each joint's motor sees when the motion starts [kg m^2], shape (1 or nsim, joint)."""
        at = np.atleast_2d(self.reference.q[0])
        if self.vary:
            return self.model.inertia(at + np.zeros((self.nsim, 1)))
        return InverseDynamics(self.nominal, len(at)).inertia(at)

    @cached_property
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
        w = per_joint(self.bandwidth, task.nominal.n, "controller.bandwidth")
        M, ahead = task.inertia, self.feedforward * task.feedforward
        return _law("pd_feedforward", task, M * w**2, M * 2 * self.damping * w, self.cutoff, signals=(ahead,))


@settings
class PID(AbstractClosedLoop):
    """PID: u = M (3 w^2 e + 3 w de/dt + w^3 int e), all poles at -w for a constant inertia."""

    bandwidth: EachPositive = (15.0,)
    """Triple pole w of the loop [rad/s], of all joints or of each."""
    cutoff: Positive = 100.0
    """First-order low-pass on de/dt [Hz]."""

    def start(self, task: Task) -> AbstractLaw:
        """Return the law, its gains for the inertia at the start of the motion."""
        w, M = per_joint(self.bandwidth, task.nominal.n, "controller.bandwidth"), task.inertia
        # What holds the arm at rest is what the integrator would have found before the motion begins.
        others = M * w**3 / task.reference.fs, task.feedforward[0], 0.0
        return _law("pid", task, 3 * M * w**2, 3 * M * w, self.cutoff, *others)


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
        w, planned = per_joint(self.bandwidth, task.nominal.n, "controller.bandwidth"), task.reference
        models = varied_models(task.nominal, task.nsim, task.vary)
        datas = [mujoco.MjData(model) for model in models]
        functions = [mujoco_function(name) for name in ("mj_fwdPosition", "mj_fwdVelocity")]
        robots = [
            [*functions, m._address, d._address]
            + [pointer(x) or 0 for x in (d.qpos, d.qvel, d.M, d.qfrc_bias, d.qfrc_passive, m.M_rownnz, m.M_colind)]
            for m, d in zip(models, datas, strict=True)
        ]
        gains = w**2, 2 * self.damping * w, self.cutoff, 1 + self.model_error
        signals = planned.qd, planned.qdd
        return _law("computed_torque", task, *gains, signals=signals, objects=Addresses(robots, (models, datas)))


@settings
class PositionCommand(AbstractController):
    """The planned positions, sent to servos."""

    commanded: ClassVar[Commanded] = "position"

    def start(self, task: Task) -> AbstractLaw:
        """Return the commands of a motion."""
        return CompiledLaw("position_command", (task.nsim, task.nominal.n), (), signals=(_of_each(task.reference.q),))


class CompiledLaw(AbstractCompiledPart, AbstractLaw):
    """A controller in C."""

    def command(self, k: int, q: Array) -> Array:
        """Command of a sample, as in the loop."""
        return self.call_sampled(k, q)


def _law(
    name: str,
    task: Task,
    kp: Array,
    kd: Array,
    cutoff: float,
    *others: npt.ArrayLike,
    signals: Sequence[Array] = (),
    objects: Addresses | None = None,
) -> CompiledLaw:
    """Return a law of the control error and its rate behind a low-pass [Hz]."""
    fs = task.reference.fs
    rows = kp, kd, 1 - np.exp(-2 * np.pi * cutoff / fs), fs, 0.0, 0.0, *others
    each = [_of_each(x) for x in (task.reference.q, *signals)]
    return CompiledLaw(name, (task.nsim, task.nominal.n), rows, signals=each, objects=objects)


def _of_each(signal: Array) -> Array:
    """Return a signal of all simulations, shape (time, joint), or of each, (time, nsim, joint), by simulation."""
    return signal[None] if signal.ndim == 2 else signal.swapaxes(0, 1)


CONTROLLERS: PluginTable[AbstractController] = PluginTable(
    "controllers",
    AbstractController,  # type: ignore[type-abstract]  # only asked whether an instance is one
    {"pd": PDFeedforward, "pid": PID, "computed_torque": ComputedTorque, "position": PositionCommand},
)
