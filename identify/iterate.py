"""The loop of every method that iterates, which is its step, and the minimum of a function of one number."""

from collections.abc import Callable
from contextlib import nullcontext
from math import copysign, sqrt
from typing import TypeVar

import numpy as np
import numpy.typing as npt

from idbench.identify.arrays import Array
from idbench.identify.telling import stage

Value = TypeVar("Value")

Converged = bool | np.bool_ | npt.NDArray[np.bool_]
"""Whether a step was small enough to be the last; of several independent runs, shape (...), whether that of each was."""


def by_run(new: Array, active: npt.NDArray[np.bool_], before: Array) -> Array:
    """Values, shape (..., m), new in the runs that are active, shape (...)."""
    return np.where(active[..., None], new, before)


def iterate(
    step: Callable[[Value], tuple[Value, Converged]],
    start: Value,
    rounds: int,
    *,
    keep: Callable[[Value, npt.NDArray[np.bool_], Value], Value] | None = None,
    shown: bool = False,
) -> tuple[Value, bool]:
    """The last value of x(k+1) = step(x(k)), and whether it has converged.

    Parameters
    ----------
    step : callable
        x(k) -> x(k+1), and whether it has converged. A step that finds nothing better returns x(k) and True.
    start : Value
        x(0).
    rounds : int
        Steps at most.
    keep : callable, optional
        What is kept of x(k+1), runs that have not converged yet, and x(k): with `by_run` each run is iterated as if it were
        alone. By default x(k+1).
    shown : bool
        Whether progress shows each step.
    """
    value, active = start, np.array(True)
    for number in range(1, rounds + 1):
        with stage(f"round {number} of at most {rounds}") if shown else nullcontext():
            new, converged = step(value)
        value = keep(new, active, value) if keep else new
        active = active & ~np.asarray(converged)
        if not active.any():
            return value, True
    return value, False


def not_converged(what: str, move: float, rounds: int, advice: str) -> str:
    """Message of an iteration that has not converged; `move` is the last step over its standard error."""
    return f"{what} did not converge in {rounds} rounds, the last step is {move:.2g} sigma: {advice}"


GOLDEN = (3 - sqrt(5)) / 2  # Share of an interval at which a golden section divides it


def minimum(f: Callable[[float], float], low: float, high: float, xtol: float) -> float:
    """Minimum of a function of one number, which has one minimum between `low` and `high`, to `xtol`.

    R. P. Brent, Algorithms for Minimization without Derivatives, Prentice-Hall 1973, chapter 5: through the best three points,
    x, w and v, goes a parabola, whose lowest point is

        u = x - ((x - w)^2 (f(x) - f(v)) - (x - v)^2 (f(x) - f(w))) / (2 ((x - w) (f(x) - f(v)) - (x - v) (f(x) - f(w))));

    where that would leave the interval, or steps do not halve, a golden section is taken. (`scipy.optimize` has the same and
    takes 0.15 s to load, more than a search.)
    """
    x = w = v = low + GOLDEN * (high - low)
    fx = fw = fv = f(x)
    step = before = 0.0
    while abs(x - (low + high) / 2) > 2 * xtol - (high - low) / 2:
        middle = (low + high) / 2
        r, q = (x - w) * (fx - fv), (x - v) * (fx - fw)
        p, divisor = (x - v) * q - (x - w) * r, 2 * (r - q)
        is_inside = divisor != 0 and low < x + p / divisor < high
        if abs(before) > xtol and is_inside and abs(p / divisor) < abs(before) / 2:
            before, step = step, p / divisor
            if min(x + step - low, high - x - step) < 2 * xtol:
                step = copysign(xtol, middle - x)
        else:
            before = (low if x >= middle else high) - x
            step = GOLDEN * before
        u = x + copysign(max(abs(step), xtol), step)
        fu = f(u)
        if fu <= fx:
            low, high = (low, x) if u < x else (x, high)
            (v, fv), (w, fw) = (w, fw), (x, fx)
            x, fx = u, fu
            continue
        low, high = (u, high) if u < x else (low, u)
        if fu <= fw or w == x:
            (v, fv), (w, fw) = (w, fw), (u, fu)
        elif fu <= fv or v in (x, w):
            v, fv = u, fu
    return x
