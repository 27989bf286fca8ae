"""What a drive is: what stands between a commanded torque and the torque at the joint."""

from abc import ABC, abstractmethod
from typing import ClassVar, Literal, NamedTuple

import mujoco
import numpy as np

from idbench.sim.part import AbstractCompiledPart
from idbench.sim.robot.motors import Array
from idbench.sim.robot.robot import Robot


class BetweenEdges(NamedTuple):
    """What a winding does within the periods of its chopper, as solved, all of shape (point, period, joint).

    Points come in threes: beginning, middle and end of a time in which the voltage is constant, and which may be empty.
    """

    t: Array
    """Since the beginning of the period [s]."""

    current: Array
    """[A]."""

    voltage: Array
    """At the winding [V]."""


class Electric(NamedTuple):
    """What a drive does, step by step or in the mean over samples, all of shape (time, joint)."""

    reference: Array
    """Current that was asked for, within its limit [A]."""

    current: Array
    """Mean current of each step [A]."""

    voltage: Array
    """Mean voltage at the winding in each step [V]."""

    duty: Array
    """Modulation index: the mean voltage that was asked for, over the bus voltage."""

    limited: Array
    """1 where current or voltage was at its limit, otherwise 0."""

    emf: Array
    """Back-EMF [V]."""


Trace = tuple[Array, ...]

Commanded = Literal["torque", "position"]
"""What a controller commands, and a drive obeys."""


class AbstractAmplifier(ABC):
    """A drive at work; what it remembers is of shape (nsim, joint)."""

    trace: Trace = ()
    """What the last call of `step` did, raw, (steps or 1, nsim, joint) or (nsim, joint) each; empty without currents."""

    def sees(self, q: Array) -> None:
        """Receive the positions in the middle of the steps to come, shape (steps or 1, nsim, joint), before `step`."""

    @abstractmethod
    def step(self, demand: Array, speed: Array, steps: int) -> Array:
        """Advance by some physics steps; return the torques in them [N m].

        Parameters
        ----------
        demand : Array, shape (nsim, joint)
            What is commanded, its mean over the steps [N m, or rad for drives that take positions].
        speed : Array, shape (steps or 1, nsim, joint)
            Speed in the middle of every step, times the torque constant over its nominal value [rad/s]; that in the middle of
            all of them for a steady drive.
        steps : int
            How many.

        Returns
        -------
        Array, shape (steps or 1, nsim, joint)
            The mean torque in every step, or in all of them.
        """

    @abstractmethod
    def electric(self, trace: Trace, dt: Array) -> Electric:
        """Return currents and voltages of the first simulation from its traces.

        Parameters
        ----------
        trace : tuple of Array, shape (step, joint)
            As this drive left them; not empty.
        dt : Array, shape (step, 1)
            How long each step was [s].
        """

    def between_edges(self, trace: Trace) -> BetweenEdges | None:
        """Currents of the first simulation within the steps of a trace; None for a drive that has no edges."""
        return None


class AbstractCompiledAmplifier(AbstractCompiledPart, AbstractAmplifier):
    """A drive in C, which leaves signals of its own as a trace."""

    signals: ClassVar[int] = 0
    """How many, in the order of its function."""

    _q: Array | float = 0.0

    def sees(self, q: Array) -> None:
        """Receive positions."""
        self._q = q

    def step(self, demand: Array, speed: Array, steps: int) -> Array:
        """Advance as the loop does."""
        tau, trace = self.call_drive(demand, np.asarray(self._q), speed, steps, self.signals)
        self.trace = tuple(trace)
        return tau


class AbstractDrive(ABC):
    """The settings of a drive."""

    commands: ClassVar[Commanded] = "torque"
    """What it takes."""

    has_own_motors: ClassVar[bool] = False
    """Whether it needs none of the robot's motors (dcmotor elements of its file)."""

    steady: ClassVar[bool] = False
    """Whether the torque, once the first step of a command is over, may be taken as one mean for any number of steps."""

    @abstractmethod
    def start(self, robot: Robot, nsim: int, h: float) -> AbstractAmplifier:
        """Return the drive at rest, to be advanced by physics steps of `h` [s].

        Raises
        ------
        RobotError
            If the robot's motors are not described well enough.
        ScenarioError
            If a setting does not fit the motors.
        """

    def edit(self, spec: mujoco.MjSpec) -> None:
        """Write what belongs to the drive into the joints of a robot."""

    def play(self, robot: Robot) -> Array:
        """Return the backlash of every joint [rad], shape (joint,)."""
        return np.zeros(robot.n)

    @property
    def before_gear(self) -> bool:
        """Whether encoders see the rotor rather than the link: with backlash, these differ."""
        return False

    def conditions(self, t: Array, command: Array) -> dict[str, Array]:
        """Further columns of the log at its instants t [s], shape (nsim, time, joint) or less.

        Parameters
        ----------
        t : Array, shape (time,)
            [s].
        command : Array, shape (nsim, time, joint)
            What was commanded.
        """
        return {}

    @abstractmethod
    def lag(self, robot: Robot) -> Array:
        """Lag of the torque behind a slow command [s], shape (joint,)."""

    def step_length(self, fs: float, longest: float) -> float:
        """Return the physics step [s] that fits whole times into a sample of 1/`fs` and is not above `longest`."""
        return 1 / fs / max(1, int(np.ceil(1 / fs / longest - 1e-9)))
