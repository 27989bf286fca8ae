"""The minimum of a function of one number."""

from collections.abc import Callable
from math import copysign, sqrt

GOLDEN = (3 - sqrt(5)) / 2  # Share of an interval at which a golden section divides it


def minimum(f: Callable[[float], float], low: float, high: float, xtol: float) -> float:
    """Minimum of a function of one number between two.

    R. P. Brent, Algorithms for Minimization without Derivatives, Prentice-Hall 1973, chapter 5: through the best three points,
    x, w and v, goes a parabola, whose lowest point is

        u = x - ((x - w)^2 (f(x) - f(v)) - (x - v)^2 (f(x) - f(w))) / (2 ((x - w) (f(x) - f(v)) - (x - v) (f(x) - f(w))));

    where that would leave the interval, or steps do not halve, a golden section is taken. (`scipy.optimize` has the same and
    takes 0.15 s to load, more than a search.)

    Parameters
    ----------
    f : callable
        The function, with one minimum between the two.
    low, high : float
        Ends of the interval.
    xtol : float
        How near the minimum the result is.
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
