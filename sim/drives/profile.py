"""The target of a servo's firmware, which follows commands within a rate and an acceleration."""

import numpy as np

from idbench.sim.robot.motors import Array


def within(x: Array, limit: float | Array) -> Array:
    """Return values within a limit of either sign; at every physics step, `np.clip` would take three times as long."""
    return np.minimum(np.maximum(x, -limit), limit)


class Profile:
    """Targets at work.

    Parameters
    ----------
    rate : float
        Largest speed [rad/s].
    acceleration : float
        Largest acceleration [rad/s^2].
    h : float
        Step [s].
    """

    def __init__(self, rate: float, acceleration: float, h: float) -> None:
        self._rate = rate
        self._acceleration = acceleration
        self._h = h
        self._target: Array | None = None
        self._speed: Array = np.zeros(1)

    def follow(self, command: Array) -> Array:
        """Return the mean target of the step to come, shape of the command; it begins at the first command."""
        if self._target is None:
            self._target, self._speed = command.copy(), np.zeros_like(command)
        before, h = self._target, self._h
        if np.isfinite(self._acceleration):
            speed = self._accelerated(command - before)
            self._target = before + (self._speed + speed) / 2 * h
            self._speed = speed
            return (before + self._target) / 2
        move = within(command - before, self._rate * h)
        self._target = before + move
        # A command that is reached within the step counts for the rest of it.
        return self._target - move * np.abs(move) / (2 * self._rate * h)

    def _accelerated(self, way: Array) -> Array:
        """Return the speed v at the end of the step: the fastest that still stops, with v h / 2 + v^2 / 2a of way left."""
        a, h = self._acceleration, self._h
        left = np.maximum(np.abs(way) - np.sign(way) * self._speed * h / 2, 0.0)
        fastest = np.sqrt(2 * a * left + (a * h / 2) ** 2) - a * h / 2
        wanted = np.sign(way) * np.minimum(fastest, self._rate)
        return np.clip(wanted, self._speed - a * h, self._speed + a * h)
