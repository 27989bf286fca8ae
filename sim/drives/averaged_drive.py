"""A current-controlled DC motor, its chopper averaged away."""

from typing import ClassVar

import numpy as np

from idbench.sim.drives.drive import AbstractAmplifier, AbstractDrive, Electric, Trace, every
from idbench.sim.drives.pwm import within
from idbench.sim.errors import ScenarioError
from idbench.sim.robot.motors import Array, Motors
from idbench.sim.robot.robot import Robot
from idbench.sim.settings import EachPositiveOrNone, Positive, per_joint, settings


def limits(robot: Robot, voltage: EachPositiveOrNone, current: EachPositiveOrNone) -> tuple[Array, Array]:
    """Return the bus voltage [V] and largest current [A] of every joint: a setting, or what the motors have, if less."""
    motors = robot.motors
    n = robot.n
    unlimited = (np.inf,)
    V = np.minimum(motors.V, per_joint(voltage or unlimited, n, "drive.bus_voltage"))
    return V, np.minimum(motors.I, per_joint(current or unlimited, n, "drive.current_limit"))


@settings
class AveragedDrive(AbstractDrive):
    """Current-controlled DC motor: winding, bus voltage and current limit; the current loop is of first order.

    L di/dt = v - R i - K qd with v = R i + L w (i_ref - i) + K qd as long as that is within the bus voltage: a PI controller
    whose zero cancels the winding's pole, and that knows the back-EMF. The equation is solved exactly for the speed in the
    middle of a stretch: the first physics step of a command, and the rest of its period.
    """

    steady: ClassVar[bool] = True

    bandwidth: Positive = 1000.0
    """Bandwidth of the current loop, w / (2 pi) [Hz]."""
    bus_voltage: EachPositiveOrNone = None
    """Bus voltage [V], of all joints or of each; without it, or where the robot's motors have less, theirs holds."""
    current_limit: EachPositiveOrNone = None
    """Largest current [A], of all joints or of each; without it, or where the robot's motors have less, theirs holds."""

    def start(self, robot: Robot, nsim: int, h: float) -> AbstractAmplifier:
        """Return the drive without current."""
        V, I = limits(robot, self.bus_voltage, self.current_limit)  # noqa: E741
        return _Amplifier(robot.motors, 2 * np.pi * self.bandwidth, V, I, nsim, h)

    def lag(self, robot: Robot) -> Array:
        """Return 1 / w."""
        return np.full(robot.n, 1 / (2 * np.pi * self.bandwidth))


class _Amplifier(AbstractAmplifier):
    """i follows the loop with rate w; where that needs more than the bus voltage, the winding's own rate R/L comes first."""

    def __init__(self, motors: Motors, w: float, V: Array, I: Array, nsim: int, h: float) -> None:  # noqa: E741
        if (w * motors.L <= motors.R).any():
            raise ScenarioError(
                f"drive.bandwidth = {w / 2 / np.pi:g} Hz must be above that of the bare winding, "
                f"{(motors.R / motors.L / 2 / np.pi).max():.3g} Hz"
            )
        self._w, self._h = w, h
        self._R, self._L, self._K, self._V, self._I = (every(x, nsim) for x in (motors.R, motors.L, motors.K, V, I))
        self._i = np.zeros(self._R.shape)
        self._known: dict[int, tuple[Array, Array]] = {}

    def step(self, demand: Array, speed: Array, steps: int) -> Array:
        dt = steps * self._h
        e = self._K * speed[len(speed) // 2]
        i0 = self._i
        limited = within(demand / self._K, self._I)
        target = np.minimum(np.maximum(limited, (-self._V - e) / self._R), (self._V - e) / self._R)
        asked = self._R * i0 + self._L * self._w * (target - i0) + e
        saturated = np.abs(asked) > self._V
        if saturated.any():  # L di/dt = v - R i - e with v at its limit, for the time t
            v = np.copysign(self._V, asked)
            t = np.where(saturated, np.minimum(self._release(v, target, e), dt), 0.0)
            end = (v - e) / self._R
            i1 = np.where(saturated, end + (i0 - end) * np.exp(-t * self._R / self._L), i0)
            charge = np.where(saturated, end * t - (i1 - i0) * self._L / self._R, 0.0)
            away, rest = i1 - target, dt - t
            left, lost = self._relaxed(rest)
            current = (charge + target * rest - away * lost) / dt
        else:
            away = i0 - target
            if steps not in self._known:
                self._known[steps] = self._relaxed(np.array([steps * self._h]))
            left, lost = self._known[steps]
            current = (target * dt - away * lost) / dt
        self._i = target + away * left
        self.trace = demand, limited, current, i0, self._i, e, saturated
        return (self._K * current)[None]

    def _relaxed(self, rest: Array) -> tuple[Array, Array]:
        """Decay of a deviation after a time [s], exp(-w t), and minus its integral, (exp(-w t) - 1) / w."""
        return np.exp(-self._w * rest), np.expm1(-self._w * rest) / self._w

    def electric(self, trace: Trace, dt: Array) -> Electric:
        demand, reference, current, i0, i1, e, saturated = trace
        R, L, K, V, most = (x[0] for x in (self._R, self._L, self._K, self._V, self._I))
        voltage = R * current + L * (i1 - i0) / dt + e
        limited = np.maximum(saturated, np.abs(demand) > most * K)
        duty = np.where(np.isfinite(V), voltage / V, np.nan)  # a share of a bus that has no end is none
        return Electric(reference, current, voltage, duty, limited, e)

    def _release(self, v: Array, target: Array, e: Array) -> Array:
        """Time [s] for which the loop asks for more than the voltage `v`, which is all there is."""
        R = self._R
        L = self._L
        w = self._w
        end, released = (v - e) / R, (v - e - L * w * target) / (R - L * w)  # currents far later, and when it asks for v
        share = (released - end) / np.where(self._i == end, 1.0, self._i - end)
        return -np.log(np.minimum(np.maximum(share, 1e-300), 1.0)) * L / R
