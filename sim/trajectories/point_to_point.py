"""Fifth-order point-to-point trajectories, in closed form."""

from dataclasses import dataclass

import numpy as np

from idbench.sim.errors import ScenarioError
from idbench.sim.robot.motors import Array
from idbench.sim.trajectories.trajectory import AbstractMotion, Reference

PEAK_VELOCITY = 15 / 8  # Largest |ds/du| of s(u) = 10 u^3 - 15 u^4 + 6 u^5, at u = 1/2


@dataclass(frozen=True, eq=False)
class PointToPoint(AbstractMotion):
    """Moves from waypoint to waypoint, each of fifth order and at rest at both ends, with pauses at the waypoints.

    q(t) = q_i + (q_(i+1) - q_i) s(u), s(u) = 10 u^3 - 15 u^4 + 6 u^5, u = (t - t_i) / T_i: all joints start and stop together.

    Raises
    ------
    ScenarioError
        If shapes do not fit, a value is not finite, a duration is not above zero or a pause is negative.
    """

    waypoints: Array
    """Positions at rest [rad], at least two, shape (w, joint)."""
    durations: Array
    """Time of every move [s], shape (w - 1,)."""
    dwells: Array
    """Pause at every waypoint [s], shape (w,)."""

    def __post_init__(self) -> None:
        for name in ("waypoints", "durations", "dwells"):
            values = np.array(getattr(self, name), dtype=np.float64)
            if not np.isfinite(values).all():
                raise ScenarioError(f"{name} hold a value that is not finite")
            values.setflags(write=False)
            object.__setattr__(self, name, values)
        w = len(self.waypoints)
        if self.waypoints.ndim != 2 or w < 2 or self.waypoints.shape[1] < 1:
            raise ScenarioError(f"waypoints have shape {self.waypoints.shape}, not (at least 2, joints)")
        if self.durations.shape != (w - 1,) or self.dwells.shape != (w,):
            raise ScenarioError(
                f"{w} waypoints need {w - 1} durations and {w} dwells, not {self.durations.size} and {self.dwells.size}"
            )
        if self.durations.min() <= 0 or self.dwells.min() < 0:
            raise ScenarioError(
                f"durations must be above 0 s and dwells not below: {self.durations.min():g}, {self.dwells.min():g}"
            )

    @property
    def duration(self) -> float:
        """Time from the first to the last instant, pauses included [s]."""
        return float(self.durations.sum() + self.dwells.sum())

    @property
    def peak_velocity(self) -> Array:
        """Largest speed of every joint [rad/s], shape (joint,)."""
        return (PEAK_VELOCITY * np.abs(np.diff(self.waypoints, axis=0)) / self.durations[:, None]).max(axis=0)

    def at(self, t: Array, fs: float) -> Reference:
        """Return the motion at the times `t` [s], shape (time,); before the start and after the end it rests."""
        start = self.dwells[:-1].cumsum() + np.concatenate([[0.0], self.durations[:-1].cumsum()])
        move = np.clip(np.searchsorted(start, t, side="right") - 1, 0, len(start) - 1)
        T = self.durations[move][:, None]
        u = np.clip((t - start[move])[:, None] / T, 0.0, 1.0)
        change = np.diff(self.waypoints, axis=0)[move]
        q = self.waypoints[move] + change * u**3 * (10 - 15 * u + 6 * u**2)
        qd = change / T * 30 * u**2 * (1 - u) ** 2
        qdd = change / T**2 * 60 * u * (1 - u) * (1 - 2 * u)
        return Reference(fs, q, qd, qdd)


def at_rest(waypoints: Array, durations: Array, rest: float) -> PointToPoint:
    """Return moves without pauses between them, and `rest` [s] before the first and after the last."""
    dwells = np.zeros(len(waypoints))
    dwells[[0, -1]] = rest
    return PointToPoint(waypoints, durations, dwells)
