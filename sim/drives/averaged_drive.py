"""A current-controlled DC motor, its chopper averaged away."""

from typing import ClassVar

import numpy as np

from idbench.sim.drives.drive import AbstractAmplifier, AbstractCompiledAmplifier, AbstractDrive, Electric, Trace
from idbench.sim.errors import ScenarioError
from idbench.sim.robot.motors import Array
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
        m, w = robot.motors, 2 * np.pi * self.bandwidth
        if (w * m.L <= m.R).any():
            raise ScenarioError(
                f"drive.bandwidth = {self.bandwidth:g} Hz must be above that of the bare winding, "
                f"{(m.R / m.L / 2 / np.pi).max():.3g} Hz"
            )
        return _Amplifier("averaged_drive", (nsim, robot.n), (m.K, m.R, m.L, V, I, w, 0.0), h)

    def lag(self, robot: Robot) -> Array:
        """Return 1 / w."""
        return np.full(robot.n, 1 / (2 * np.pi * self.bandwidth))


class _Amplifier(AbstractCompiledAmplifier):
    """i follows the loop with rate w; where that needs more than the bus voltage, the winding's own rate R/L comes first."""

    signals: ClassVar[int] = 7

    def electric(self, trace: Trace, dt: Array) -> Electric:
        demand, reference, current, i0, i1, e, saturated = trace
        K, R, L, V, most = self.x[0, :5]
        voltage = R * current + L * (i1 - i0) / dt + e
        limited = np.maximum(saturated, np.abs(demand) > most * K)
        duty = np.where(np.isfinite(V), voltage / V, np.nan)  # a share of a bus that has no end is none
        return Electric(reference, current, voltage, duty, limited, e)
