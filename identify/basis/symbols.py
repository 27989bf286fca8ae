"""Arrays of symbols, for code that is written for arrays of numbers."""

from collections.abc import Callable
from functools import reduce
from operator import sub
from typing import Any

import numpy as np
import numpy.typing as npt
from numpy.lib.mixins import NDArrayOperatorsMixin

from idbench.identify.basis.tape import NUMBERS, OPERATIONS, Symbol, Tape, Value
from idbench.identify.errors import SettingError

Values = list[Any]
"""Arrays of symbols, or numbers."""


class SymbolArray(NDArrayOperatorsMixin):
    """An array of values that are recorded, symbols and numbers of any shape, for code that is written for arrays of numbers.

    Raises
    ------
    SettingError
        If a function of NumPy is asked for that is none of `OPERATIONS`.
    """

    def __init__(self, values: Any) -> None:
        self.values = _array(values)

    @property
    def shape(self) -> tuple[int, ...]:
        """Its shape."""
        return self.values.shape

    @property
    def ndim(self) -> int:
        """Number of its axes."""
        return self.values.ndim

    def __getitem__(self, key: Any) -> "SymbolArray":
        return SymbolArray(self.values[key])

    def __len__(self) -> int:
        return len(self.values)

    def __array_ufunc__(self, function: Any, method: str, *of: Any, **more: Any) -> Any:
        if function is np.isfinite:
            return np.ones(self.shape, dtype=bool)
        if function is np.square:
            function, of = np.power, (*of, 2.0)
        if function is np.add and method == "reduce":
            return _reduced(self, **more)
        if more:
            raise SettingError(
                f"numpy.{function.__name__} into an array that is there cannot be written: x = x * y, not x *= y"
            )
        if method != "__call__" or function not in OPERATIONS:
            raise _unknown(function)
        return _elementwise(OPERATIONS[function], *of)

    def __array_function__(self, function: Any, types: Any, of: Any, more: Any) -> Any:
        if function not in _FUNCTIONS:
            raise _unknown(function)
        return _FUNCTIONS[function](*of, **more)


def inputs(tape: Tape, name: str, count: int) -> SymbolArray:
    """Return signals of so many joints at one instant, shape (joint, 1)."""
    return SymbolArray([[tape.input(name, j)] for j in range(count)])


def _unknown(function: Any) -> SettingError:
    known = ", ".join(sorted(each.__name__ for each in (*OPERATIONS, *_FUNCTIONS)))
    return SettingError(f"numpy.{function.__name__} cannot be written as a formula; what can: {known}")


def _array(values: Any) -> npt.NDArray[Any]:
    """Return symbols and numbers as an array."""
    if isinstance(values, SymbolArray):
        return values.values
    if isinstance(values, list | tuple):
        values = [_array(x) if isinstance(x, SymbolArray) else x for x in values]
    return np.asarray(values, dtype=object if isinstance(values, list | Symbol) else None)


def _elementwise(operation: str, *of: Any) -> SymbolArray:
    arrays = np.broadcast_arrays(*(_array(x) for x in of))
    found = np.empty(arrays[0].shape, dtype=object)
    for place in np.ndindex(found.shape):
        each: list[Any] = [x[place] for x in arrays]
        tape = next((x.tape for x in each if isinstance(x, Symbol)), None)
        numbers = [x if isinstance(x, Symbol) else float(x) for x in each]
        with np.errstate(all="ignore"):  # where nothing is known, constants are NaN
            found[place] = float(NUMBERS[operation](*numbers)) if tape is None else tape.apply(operation, *numbers)
    return SymbolArray(found)


def _reduced(x: SymbolArray, axis: int | None = None, keepdims: bool = False, **more: Any) -> Any:
    del more
    values = x.values.ravel() if axis is None else np.moveaxis(x.values, axis, 0)
    total: Any = 0.0
    for part in values:
        total = _elementwise("+", total, part)
    return SymbolArray(np.expand_dims(total.values, axis)) if keepdims and axis is not None else total


def _extreme(x: Any, low: Any, high: Any) -> Any:
    x = x if low is None else np.maximum(x, low)
    return x if high is None else np.minimum(x, high)


_FUNCTIONS: dict[Any, Callable[..., Any]] = {
    np.shape: lambda x: x.shape,
    np.ndim: lambda x: x.ndim,
    np.sum: lambda x, axis=None, keepdims=False: _reduced(x, axis, keepdims),
    np.where: lambda *of: _elementwise("where", *of),
    np.clip: _extreme,
    np.broadcast_to: lambda x, shape: SymbolArray(np.broadcast_to(x.values, shape)),
    np.stack: lambda of, axis=0: SymbolArray(np.stack([_array(x) for x in of], axis)),
    np.ones_like: lambda x, **_: np.ones(x.shape),
    np.zeros_like: lambda x, **_: np.zeros(x.shape),
    np.any: lambda x, **_: any(isinstance(one, Symbol) or bool(one) for one in x.values.flat),
}


def flat(x: Any) -> list[Value]:
    """Return the values of something recorded, or of numbers, in a row."""
    return [one if isinstance(one, Symbol) else float(one) for one in _array(x).flat]


def solved(M: list[Values], b: Values) -> Values:
    """Return x = M^-1 b of a symmetric positive definite matrix, by L D L'."""
    n = len(M)
    L: list[Values] = [[0.0] * n for _ in range(n)]
    D: Values = []
    for j in range(n):
        below = [L[j][k] * D[k] for k in range(j)]
        D.append(reduce(sub, [L[j][k] * below[k] for k in range(j)], M[j][j]))
        for i in range(j + 1, n):
            L[i][j] = reduce(sub, [L[i][k] * below[k] for k in range(j)], M[i][j]) / D[j]
    y: Values = []
    for i in range(n):
        y.append(reduce(sub, [L[i][k] * y[k] for k in range(i)], b[i]))
    x: Values = [0.0] * n
    for i in reversed(range(n)):
        x[i] = reduce(sub, [L[k][i] * x[k] for k in range(i + 1, n)], y[i] / D[i])
    return x
