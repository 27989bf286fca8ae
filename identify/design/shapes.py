"""Motions that are linear in their coefficients: sums of shapes that rest at both ends."""

from dataclasses import dataclass
from typing import Self

import numpy as np

from idbench.identify.arrays import Array
from idbench.identify.errors import SettingError

ORDERS = 4  # Position, velocity, acceleration, jerk


@dataclass(frozen=True, eq=False)
class Shapes:
    """Unit motions of a joint at some instants; every joint moves along a sum of them."""

    values: Array
    """Position, velocity, acceleration and jerk of each of m shapes, shape (4, time, m)."""

    @property
    def count(self) -> int:
        """Number of shapes m."""
        return int(self.values.shape[-1])

    def at(self, c: Array) -> Array:
        """Return the motion of coefficients c, shape (..., m, joint), shape (..., 4, time, joint)."""
        return np.matmul(self.values, c[..., None, :, :])

    @classmethod
    def fourier(cls, t: Array, period: float, harmonics: int) -> Self:
        """Return a constant, and the sums of harmonics of `period` [s] that rest at its ends: qd(0) = qdd(0) = 0.

        The finite Fourier series of J. Swevers et al., "Optimal robot excitation and identification", IEEE Trans. Robotics and
        Automation 13 (1997) 730-740, q = q0 + sum of a_k sin(k w t) + b_k cos(k w t); rest leaves two coefficients less.

        Raises
        ------
        SettingError
            If there are fewer than two harmonics: none alone rests.
        """
        if harmonics < 2:
            raise SettingError(f"{harmonics} harmonic of {period:g} s does not rest: use a longer period or a higher frequency")
        w = np.asarray(2 * np.pi * np.arange(1, harmonics + 1) / period)
        phase = w * t[:, None]
        sines = np.stack([w ** (i - 1) * np.sin(phase + i * np.pi / 2) for i in range(ORDERS)])
        cosines = np.stack([w ** (i - 1) * np.cos(phase + i * np.pi / 2) for i in range(ORDERS)])
        constant = np.zeros((ORDERS, len(t), 1))
        constant[0] = 1 / w[0]
        return cls(np.concatenate([constant, sines @ _across(np.ones(harmonics)), cosines @ _across(w)], axis=-1))

    @staticmethod
    def series(c: Array, period: float) -> tuple[Array, Array, Array]:
        """Return the mean [rad], shape (joint,), and the sines and cosines, shape (harmonic, joint), of coefficients c."""
        harmonics = (len(c) + 1) // 2
        w = np.asarray(2 * np.pi * np.arange(1, harmonics + 1)[:, None] / period)
        sines, cosines = c[1:harmonics], c[harmonics:]
        across = _across(np.ones(harmonics)), _across(w[:, 0])
        return c[0] / w[0], across[0] @ sines / w, across[1] @ cosines / w

    @classmethod
    def moves(cls, t: Array, period: float, count: int) -> Self:
        """Return the fifth-order moves through `count` waypoints, the last of which leads back to the first.

        Every shape is a waypoint: the moves to it and from it. All moves take as long. The paper's motions are of this kind,
        in times of their own.
        """
        T = period / count
        u = np.mod(t / T, count)
        move = np.floor(u).astype(int)
        s = quintic(u - move) / T ** np.arange(ORDERS)[:, None]
        values = np.zeros((ORDERS, len(t), count))
        rows = np.arange(len(t))
        values[:, rows, (move + 1) % count] += s
        values[:, rows, move] -= s
        values[0, rows, move] += 1.0
        return cls(values)


def quintic(u: Array) -> Array:
    """Return s(u) = 10 u^3 - 15 u^4 + 6 u^5 and its first three derivatives, shape (4, ...), for u from 0 to 1."""
    return np.stack(
        [
            u**3 * (10 - 15 * u + 6 * u**2),
            30 * u**2 * (1 - u) ** 2,
            60 * u * (1 - u) * (1 - 2 * u),
            60 * (1 - 6 * u + 6 * u**2),
        ]
    )


def _across(a: Array) -> Array:
    """Return an orthonormal base of what is across `a`, shape (k, k - 1)."""
    return np.asarray(np.linalg.qr(np.column_stack([a, np.eye(len(a))[:, :-1]]))[0][:, 1:])
