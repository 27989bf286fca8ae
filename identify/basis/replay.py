"""Columns of links as a list of operations: found once on symbols, done in pieces of the motion that stay in the cache."""

from collections.abc import Hashable, Mapping
from typing import Any, Generic, NamedTuple, TypeVar, final

import numpy as np

from idbench.identify.arrays import Array
from idbench.identify.basis.tape import OPERATIONS, Symbol, Tape, Value
from idbench.identify.signals.signals import State

Key = TypeVar("Key", bound=Hashable)

PIECE = 4096
"""Samples of a piece: a hundred values of it fill a cache of 1 MB; half and double of it take a tenth longer (PUMA 560)."""

FUNCTIONS: dict[str, Any] = {name: function for function, name in OPERATIONS.items()}
"""Operations of a tape -> what they are of arrays."""


class RecordedSignal:
    """A signal (..., joint, time) that stands in for numbers while columns are recorded.

    Parameters
    ----------
    tape : Tape
        That records.
    name : str
        Field of a `State`.
    """

    def __init__(self, tape: Tape, name: str) -> None:
        self._tape, self._name = tape, name

    def __getitem__(self, place: tuple[Any, ...]) -> Symbol:
        return self._tape.input(self._name, place[-2])


def recorded_motion(tape: Tape) -> State:
    """Return a motion of symbols, one for each joint's position, velocity and acceleration."""
    made: Any = State  # symbols for arrays
    state: State = made(RecordedSignal(tape, "q"), RecordedSignal(tape, "qd"), lambda _: RecordedSignal(tape, "qdd"))
    return state


class _Step(NamedTuple):
    """An operation on values by their places; of one value, the second is below 0."""

    function: Any
    first: int
    second: int
    result: int


@final
class Replay(Generic[Key]):
    """Values of a tape as functions of a motion.

    Parameters
    ----------
    tape : Tape
        What was recorded.
    columns : mapping
        The values that are wanted.
    """

    def __init__(self, tape: Tape, columns: Mapping[Key, Value]) -> None:
        needed = tape.needed(columns.values())
        self.inputs: list[tuple[str, int]] = []
        self.constants: list[float] = []
        self.columns: dict[Key, int | float] = {}
        """Key -> its place, or its value at all times."""
        places, constants = dict[int, int](), dict[float, int]()
        for number in needed:
            operation, *source = tape.steps[number]
            if operation == "input":
                places[number] = len(self.inputs)
                self.inputs.append((source[0], source[1]))
        self.first_result = len(self.inputs)
        self.results = 0
        for key, value in columns.items():
            if isinstance(value, Symbol) and value.number not in places:
                places[value.number] = self.first_result + self.results
                self.results += 1
            self.columns[key] = places[value.number] if isinstance(value, Symbol) else value
        used = {number: step for step in needed for number in tape.taken(step)}  # the last step that takes a value
        free, self.scratch, made = list[int](), 0, list[tuple[str, list[int | float], int]]()
        first_scratch = self.first_result + self.results
        for number in needed:
            operation, *taken = tape.steps[number]
            if operation == "input":
                continue
            given = [places[x] if isinstance(x, int) else x for x in taken]
            done = {x for x in tape.taken(number) if used[x] == number and places[x] >= first_scratch}
            free.extend(sorted(places[x] for x in done))
            if number not in places:
                if not free:
                    free.append(first_scratch + self.scratch)
                    self.scratch += 1
                places[number] = free.pop()
            made.append((operation, given, places[number]))
        last = first_scratch + self.scratch
        for _, given, _ in made:
            for x in given:
                if isinstance(x, float) and x not in constants:
                    constants[x] = last + len(constants)
        self.constants = list(constants)
        self._steps = [
            _Step(FUNCTIONS[name], *(constants[x] if isinstance(x, float) else x for x in given), *[-1] * (2 - len(given)), at)
            for name, given, at in made
        ]

    def of(self, state: State) -> dict[Key, Array]:
        """Return the values along a motion, (..., time) each."""
        signals = [getattr(state, name)[..., joint, :] for name, joint in self.inputs]
        shape = state.q[..., 0, :].shape
        signals = [x if x.shape == shape else np.broadcast_to(x, shape) for x in signals]
        results = np.empty((self.results, *shape), np.result_type(*signals, float))
        size = int(np.prod(shape))
        self._fill(results.reshape(self.results, size), [x.reshape(size) for x in signals])
        every = [*signals, *results]
        return {
            key: every[place] if isinstance(place, int) else np.broadcast_to(place, shape) for key, place in self.columns.items()
        }

    def _fill(self, results: Array, signals: list[Array]) -> None:
        """Do all steps for a piece of the motion after another."""
        scratch = np.empty((self.scratch, PIECE), results.dtype)
        constants = [np.asarray(x) for x in self.constants]
        for start in range(0, results.shape[1], PIECE):
            piece = slice(start, start + PIECE)
            found = results[:, piece]
            values = [*(x[piece] for x in signals), *found, *scratch[:, : found.shape[1]], *constants]
            for function, first, second, result in self._steps:
                if second < 0:
                    function(values[first], values[result])
                else:
                    function(values[first], values[second], values[result])
