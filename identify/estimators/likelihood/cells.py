"""A motion as cubic polynomials between nodes, and what a log says in every cell of it."""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Self

import numpy as np
import numpy.typing as npt

from idbench.identify.arrays import Array
from idbench.identify.data.motion_log import UNIFORMITY, Meaning, MotionLog
from idbench.identify.errors import IdentificationError
from idbench.identify.signals.filters import shift

GAUSS = 0.5 - np.sqrt(3) / 6, 0.5 + np.sqrt(3) / 6
"""Where the torque equation is asked for in a cell: their mean has the torque's mean over it, to fourth order."""

HELD = 0.05  # Half the difference of two torques in a cell that a drive held, over the noise of their mean: next to none


@dataclass(frozen=True, eq=False)
class Cells:
    """The cells of one log: each from the instant that a torque sample speaks for, or from which on, to that of the next."""

    log: MotionLog
    """One run."""
    delay: float
    """[s]; what sample k of the torque speaks for begins at t_k + delay."""

    @property
    def period(self) -> float:
        """Length of a cell [s]."""
        return 1 / self.log.fs

    @property
    def count(self) -> int:
        """Number of cells; there is a node more."""
        return self.log.samples if self.meaning != "instantaneous" else self.log.samples - 1

    @property
    def meaning(self) -> Meaning:
        """What a torque sample means."""
        return self.log.torque.meaning

    @cached_property
    def torque(self) -> tuple[Array, Array]:
        """Logged torque at the two Gauss points of every cell: mean, and half the difference, shape (joint, cell) [N m]."""
        tau = (self.log.tau * np.asarray(self.log.torque.gain)).T
        if self.meaning == "held":
            return tau, np.zeros_like(tau)
        if self.meaning == "averaged":
            return tau, np.gradient(tau, axis=-1) * (GAUSS[1] - GAUSS[0]) / 2
        rise = np.diff(tau, axis=-1)
        curve = np.gradient(np.gradient(tau, axis=-1), axis=-1)
        mean = (tau[:, :-1] + tau[:, 1:]) / 2 - (curve[:, :-1] + curve[:, 1:]) / 24
        return mean, rise * (GAUSS[1] - GAUSS[0]) / 2

    @cached_property
    def rough(self) -> Array:
        """What half the difference may be off by beside noise, shape (joint, 1) [N m]: torque that bends within a cell."""
        if self.meaning == "held":
            return np.zeros((self.log.n, 1))
        tau = (self.log.tau * np.asarray(self.log.torque.gain)).T
        return np.sqrt(np.mean(np.diff(tau, 2, axis=-1) ** 2, axis=-1, keepdims=True)) / 4

    @cached_property
    def inside(self) -> npt.NDArray[np.bool_]:
        """Samples of the positions that lie in a cell, shape (sample,)."""
        at = self._at
        return (at >= 0) & (at <= self.count)

    @cached_property
    def _at(self) -> Array:
        """Where samples lie, in cells."""
        at = np.arange(self.log.samples) - self.delay * self.log.fs
        return np.where(np.abs(at - np.round(at)) < 1e-9, np.round(at), at)

    @cached_property
    def places(self) -> tuple[npt.NDArray[np.intp], Array]:
        """Cell of every sample that is seen, and where it lies there, from 0 to 1."""
        at = self._at[self.inside]
        cell = np.minimum(np.floor(at).astype(np.intp), self.count - 1)
        return cell, at - cell

    def motion(self, z: Array, at: float | Array) -> tuple[Array, Array, Array]:
        """Return q, qd and qdd of nodes z, shape (node, 2, joint), at a place of every cell, shape (joint, cell) each."""
        weights = hermite(at, self.period)
        ends = np.stack([z[:-1, 0], z[:-1, 1], z[1:, 0], z[1:, 1]])
        q, qd, qdd = (np.einsum("k...,kcj->jc", w, ends) for w in weights)
        return q, qd, qdd

    @classmethod
    def of(cls, log: MotionLog) -> Self:
        """Return the cells of a log, with its own delay; torques of joints with lags are moved by these first.

        Raises
        ------
        IdentificationError
            If a torque is held or averaged over another time than the sampling period.
        """
        channel = log.torque
        if channel.period is not None and channel.meaning != "instantaneous" and abs(channel.period * log.fs - 1) > UNIFORMITY:
            raise IdentificationError(
                f"the log's torque is {channel.meaning} for {channel.period:g} s, not for its sampling period of "
                f"{1 / log.fs:.3g} s, which ML and UKF take it for: use GLS"
            )
        if log.torque.lags:
            samples = log.fs * np.array(log.torque.lags)
            tau = np.stack([shift(x, -late) for x, late in zip(np.moveaxis(log.tau, -1, 0), samples, strict=True)], axis=-1)
            log = replace(log, tau=tau, torque=replace(log.torque, lags=()))
        return cls(log, log.torque.delay)


def hermite(s: float | Array, period: float) -> tuple[Array, Array, Array]:
    """Hermite weights of (q0, qd0, q1, qd1) at place s of a cell, for q, qd and qdd, shape (4, ...) each."""
    s = np.asarray(s, dtype=np.float64)
    one, T = np.ones_like(s), period
    q = np.stack([2 * s**3 - 3 * s**2 + 1, T * (s**3 - 2 * s**2 + s), 3 * s**2 - 2 * s**3, T * (s**3 - s**2)])
    qd = np.stack([6 * s**2 - 6 * s, T * (3 * s**2 - 4 * s + one), 6 * s - 6 * s**2, T * (3 * s**2 - 2 * s)]) / T
    qdd = np.stack([12 * s - 6, T * (6 * s - 4), 6 - 12 * s, T * (6 * s - 2)]) / T**2
    return q, qd, qdd
