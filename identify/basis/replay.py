"""Columns of links as a list of operations: found once on symbols, done in pieces of the motion that stay in the cache."""

from collections.abc import Callable, Hashable, Mapping
from typing import Any, Generic, TypeVar

import numpy as np

from idbench.identify.arrays import Array
from idbench.identify.basis.tape import NUMBERS, Symbol, Tape, Value
from idbench.identify.signals.signals import State

Key = TypeVar("Key", bound=Hashable)

PIECE = 8192
"""Samples of a piece: a call of NumPy takes 0.5 us beside what it does. A quarter of it takes a third longer (PUMA 560), all of
a long log at once twice as long."""


class SignalOfSymbols:
    """A signal (..., joint, time) that stands in for numbers: one value `of` each joint, many times faster than arrays."""

    def __init__(self, of: Callable[[int], Value]) -> None:
        self._of = of

    def __getitem__(self, place: tuple[Any, ...]) -> Value:
        return self._of(place[-2])


def motion_of_symbols(q: Any, qd: Any, qdd: Any, *, conditions: Mapping[str, Any] | None = None) -> State:
    """Return a motion whose signals are of symbols, not arrays of numbers."""
    return State(q, qd, lambda _: qdd, conditions or {})


class Program(Generic[Key]):
    """Values of a tape, those of some columns, as functions of a motion.

    Places are those of the signals, then of the results, then of values that are needed for a while, then of constants.
    """

    def __init__(self, tape: Tape, columns: Mapping[Key, Value]) -> None:
        needed = tape.needed(columns.values())
        self._signals = {number: tape.steps[number][1:] for number in needed if tape.steps[number][0] == "input"}
        results = dict.fromkeys(x.number for x in columns.values() if isinstance(x, Symbol) and x.number not in self._signals)
        self._results, places = len(results), {number: k for k, number in enumerate((*self._signals, *results))}
        self._columns = {key: places[x.number] if isinstance(x, Symbol) else x for key, x in columns.items()}
        self._scratch, kept = 0, len(places)
        last = {number: step for step in needed for number in tape.taken(step)}
        free, constants = list[int](), dict[float, int]()
        steps = list[tuple[Any, list[int | float], int]]()
        for number in needed:
            operation, *taken = tape.steps[number]
            if number in self._signals:
                continue
            given = [places[x] if isinstance(x, int) else x for x in taken]
            constants.update((x, len(constants)) for x in given if isinstance(x, float) and x not in constants)
            free += sorted({places[x] for x in tape.taken(number) if last[x] == number and places[x] >= kept})
            if number not in places:
                if not free:
                    free.append(kept + self._scratch)
                    self._scratch += 1
                places[number] = free.pop()
            steps.append((NUMBERS[operation], given, places[number]))
        self._constants, first = list(constants), kept + self._scratch
        numbered = {x: first + k for x, k in constants.items()}
        self._steps = [(f, [numbered[x] if isinstance(x, float) else x for x in given], at) for f, given, at in steps]

    def of(self, state: State) -> dict[Key, Array]:
        """Return the values along a motion, (..., time) each."""
        shape = state.q[..., 0, :].shape
        size = int(np.prod(shape))
        signals = [np.broadcast_to(getattr(state, name)[..., joint, :], shape) for name, joint in self._signals.values()]
        results = np.empty((self._results, *shape), np.result_type(*signals, float))
        self._fill(results.reshape(self._results, size), [x.reshape(size) for x in signals])
        every = *signals, *results
        return {key: every[x] if isinstance(x, int) else np.broadcast_to(x, shape) for key, x in self._columns.items()}

    def _fill(self, results: Array, signals: list[Array]) -> None:
        """Do all steps for a piece of the motion after another."""
        scratch, constants = np.empty((self._scratch, PIECE), results.dtype), [np.asarray(x) for x in self._constants]
        for start in range(0, results.shape[1], PIECE):
            piece = slice(start, start + PIECE)
            found = results[:, piece]
            values = [*(x[piece] for x in signals), *found, *scratch[:, : found.shape[1]], *constants]
            for function, given, result in self._steps:
                function(*[values[x] for x in given], values[result])
