"""What Python knows of loop.c: its structures, and the places of its numbers, both in its order."""

import ctypes

import numpy as np

from idbench.identify.compiled import pointer
from idbench.sim.part import Part
from idbench.sim.robot.motors import Array
from idbench.sim.scenario.measurement import RippleSeries

DONE, READ, COMMAND, DRIVE, RESIST = range(5)
RUNNING, OUT_OF_BOUNDS, NOT_FINITE, STOPPED = range(4)
STEP, PLACE, SAMPLE, STEPS, ROWS, TORQUES, STATE, TRACED, BEFORE_STEPS = range(9)
BEFORE, COMMANDED, DEMAND, SPEED, SENSED, THEN, MEASURED, RESISTANCE = range(8)
MIDDLE_Q, MIDDLE_QD, SEEN, CONSTANT, TURNING, ELECTRIC, TAU, TOTAL = range(8)

CHANNELS = ("measured", "command", "current", "q", "qd", "tau", "gap")
"""What a loop records."""

Address, Whole, Real = ctypes.c_void_p, ctypes.c_int64, ctypes.c_double


def _fields(kind: type, names: str) -> list[tuple[str, type]]:
    return [(name, kind) for name in names.split()]


class LoopRipple(ctypes.Structure):
    """A ripple."""

    _fields_ = (*_fields(Address, "amplitude order phase harmonics"), ("count", Whole))


class LoopBody(ctypes.Structure):
    """The robot of one simulation in MuJoCo, and where a loop at work keeps it."""

    _fields_ = (
        *_fields(Address, "step model data qpos qvel applied warned"),
        *_fields(Whole, "n stride"),
        *_fields(Address, "middle half fastest N complaint"),
    )


class Loop(ctypes.Structure):
    """The closed loop of one simulation."""

    _fields_ = (
        ("body", LoopBody),
        *_fields(Whole, "samples per_sample late most steady smooth sees_rotor signals ring"),
        *_fields(Real, "old h filter"),
        *_fields(ctypes.POINTER(Part), "encoder law drive friction"),
        *_fields(LoopRipple, "cogging commutation"),
        *_fields(Address, "offsets q_ring qd_ring now rows records drawn trace"),
    )


def series(ripple: RippleSeries) -> tuple[LoopRipple, list[Array]]:
    """Return a ripple as C takes it, and the arrays that it points to."""
    arrays = [np.ascontiguousarray(x, dtype=np.float64) for x in (ripple.amplitude, ripple.order, ripple.phase)]
    arrays.append(np.array(ripple.harmonics))
    return LoopRipple(*map(pointer, arrays), len(ripple.harmonics)), arrays
