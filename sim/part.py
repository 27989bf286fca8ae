"""Parts of a simulation in C: their numbers, and what Python does with them (see part.h beside this)."""

import ctypes
from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

import mujoco
import numpy as np
import numpy.typing as npt

from idbench.identify.compiled import function, library, pointer
from idbench.sim.robot.motors import Array

SIGNALS = 4  # That a part may have


class Part(ctypes.Structure):
    """What C knows of a part of one simulation; without a function, that it is in Python."""

    _fields_ = (
        ("run", ctypes.c_void_p),
        ("n", ctypes.c_int64),
        ("stride", ctypes.c_int64),
        ("h", ctypes.c_double),
        ("x", ctypes.c_void_p),
        ("s", ctypes.c_void_p * SIGNALS),
        ("o", ctypes.c_void_p),
    )


class Addresses(NamedTuple):
    """Where in memory a part finds what it needs."""

    each: Sequence[Sequence[int]]
    """For each simulation, in the order of its function."""
    owner: object
    """What has the memory, and must outlive the part."""


class AbstractCompiledPart:
    """A part of simulations that a function in C makes, by itself for each of them.

    Parameters
    ----------
    name : str
        The function.
    shape : tuple of int
        Simulations and joints.
    rows : sequence of array_like
        Parameters and then what it remembers, in the order of the function, each of shape (nsim, joint) or less.
    h : float
        Physics step [s].
    signals : sequence of Array or None
        Of shape (1 or nsim, sample, joint), in the order of the function.
    objects : Addresses, optional
        What else it reads and writes.
    stride : int
        How far apart the joints are in MuJoCo's arrays.
    """

    def __init__(
        self,
        name: str,
        shape: tuple[int, int],
        rows: Sequence[npt.ArrayLike],
        h: float = 0.0,
        signals: Sequence[Array | None] = (),
        objects: Addresses | None = None,
        stride: int = 1,
    ) -> None:
        nsim, n = shape
        each = [np.broadcast_to(np.asarray(row, dtype=np.float64), shape) for row in rows]
        self.x = np.ascontiguousarray(np.stack(each or [np.zeros(shape)], axis=1))
        self._signals = [None if s is None else np.ascontiguousarray(s) for s in signals]
        self._kept, self._objects = objects, np.array(objects.each if objects else [[0]] * nsim, dtype=np.uint64)
        run, self._shape = ctypes.cast(library()[name], ctypes.c_void_p).value, shape
        self._name, self.parts = name, (Part * nsim)()
        for i, part in enumerate(self.parts):
            own = [None if s is None else pointer(s[i if len(s) > 1 else 0]) for s in self._signals]
            signals_of = (ctypes.c_void_p * SIGNALS)(*own)
            part.__init__(run, n, stride, h, pointer(self.x[i]), signals_of, pointer(self._objects[i]))

    def call_sampled(self, k: int, q: Array) -> Array:
        """What an encoder or controller makes of positions [rad] at sample `k`, shape (nsim, joint)."""
        run = function(self._name, ctypes.c_void_p, ctypes.c_int64, ctypes.c_void_p, ctypes.c_void_p)
        q = np.ascontiguousarray(q, dtype=np.float64)
        out = np.empty_like(q)
        for part, x, y in zip(self.parts, q, out, strict=True):
            run(ctypes.addressof(part), k, pointer(x), pointer(y))
        return out

    def call_drive(self, demand: Array, q: Array, speed: Array, steps: int, signals: int) -> tuple[Array, Array]:
        """Torques of a drive, shape (steps or 1, nsim, joint), and its signals, shape (signal, steps or 1, nsim, joint)."""
        run = function(self._name, ctypes.c_void_p, *[ctypes.c_int64] * 2, *[ctypes.c_void_p] * 5, result=ctypes.c_int64)
        nsim, n = self._shape
        tau, trace, rows = np.empty((nsim, steps, n)), np.empty((nsim, steps, signals, n)), len(speed)
        q = np.broadcast_to(q, (rows, nsim, n))
        for i, part in enumerate(self.parts):
            inputs = [np.ascontiguousarray(x, dtype=np.float64) for x in (demand[i], q[:, i], speed[:, i])]
            given = run(ctypes.addressof(part), rows, steps, *map(pointer, inputs), pointer(tau[i]), pointer(trace[i]))
        return tau[:, :given].swapaxes(0, 1), trace[:, :given].transpose(2, 1, 0, 3)

    def call_friction(self, tau: Array, qd: Array) -> Array:
        """Torque of a friction [N m], shape (nsim, joint)."""
        run = function(self._name, *[ctypes.c_void_p] * 4)
        tau, qd = (np.array(np.broadcast_to(x, self._shape), dtype=np.float64) for x in (tau, qd))
        out = np.empty(self._shape)
        for part, t, v, y in zip(self.parts, tau, qd, out, strict=True):
            run(ctypes.addressof(part), pointer(t), pointer(v), pointer(y))
        return out


@cache
def mujoco_function(name: str) -> Any:
    """Address of a function of MuJoCo."""
    folder = Path(mujoco.__file__).parent
    path = next(path for pattern in ("libmujoco.*", "mujoco.dll") for path in folder.glob(pattern))
    return ctypes.cast(ctypes.CDLL(str(path))[name], ctypes.c_void_p).value
