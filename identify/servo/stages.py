"""The stages of a servo's identification: from rows to the closed loop, with more parameters and in finer steps."""

from collections.abc import Mapping, Sequence
from typing import Self, final

import numpy as np

from idbench.identify.errors import ExcitationError, IdentificationError
from idbench.identify.one_thread import one_thread
from idbench.identify.servo.closed_loop import ServoLoop, count_of
from idbench.identify.servo.excitation import Excitation
from idbench.identify.servo.fit import ServoFit
from idbench.identify.servo.friction import SERVO_FRICTIONS, first_of
from idbench.identify.servo.parameters import FURTHER, SERVO_PARAMETERS, parameters_of
from idbench.identify.servo.pieces import pieces
from idbench.identify.servo.refusals import require_explained, require_possible, require_scale
from idbench.identify.servo.rows import ServoRows
from idbench.identify.servo.run import ServoRun
from idbench.identify.servo.search import Search
from idbench.identify.servo.servo import Servo
from idbench.identify.servo.valleys import Valleys

TRIED = 48
"""Starts of the rows that are simulated."""

FEW = 20
"""Runs of which all are looked at from the beginning, in pieces that are simulated side by side; many are whole."""

MOST_RUNS = 120
"""Runs that a search looks at; of more, as many evenly spread ones."""

COARSE, MEDIUM, FINE = 0.4, 0.2, 0.1
"""Longest steps, as shares of the sampling time: of first stages, of the last with whole runs, and with pieces."""

PLAYS = np.array([0.5, 1.0, 2.0, 4.0, 8.0, 16.0, 32.0])
"""Backlash that is tried first [counts]."""


@final
class Stages:
    """Runs at work: from stage to stage with more parameters, and finer.

    Parameters
    ----------
    servo, runs, held
        As for `identify_servo`.
    start : mapping of str to float
        Parameters of the first stage.
    """

    def __init__(self, servo: Servo, runs: Sequence[ServoRun], held: dict[str, float], start: Mapping[str, float]) -> None:
        self.held, self._servo, self._excitation = held, servo, Excitation.of(servo, runs, held)
        self.start, self._few = dict(start), len(_evenly(runs)) <= FEW
        self._whole = looked_at(servo, runs, self.start["delay"])
        self._coarse = ServoLoop(servo, self._whole if self._few else self._whole[::2], COARSE * self._excitation.T)
        self._valleys = Valleys(self._coarse, self._excitation, held)

    @classmethod
    def begun(cls, servo: Servo, runs: Sequence[ServoRun], more: Sequence[str], held: dict[str, float]) -> Self:
        """Return stages that begin with the start of the rows whose simulation fits best."""
        require_possible(held)
        excitation, some = Excitation.of(servo, runs, held), _evenly(runs)
        if "Fo" in more and not excitation.off:
            raise ExcitationError(f"{runs[0].name}: Fo is unidentifiable, because torque is never off in a motion")
        with one_thread():
            return cls(servo, runs, held, _started(servo, some, held, excitation))

    def go(self, friction: str, more: Sequence[str], p: Mapping[str, float]) -> dict[str, float]:
        """Return the parameters with a law of friction and further ones, from those of a simpler law."""
        first = first_of(friction, p, self._excitation.speed) | dict.fromkeys(more, 0.0)
        begin = {**first, **p, **self.held}
        if "backlash" in more and "backlash" not in {**p, **self.held}:
            begin["backlash"] = _play(self._servo, self._coarse, begin)
        known = {*parameters_of(friction, more), *(name for name in self.held if name in FURTHER)}
        begin = {name: x for name, x in begin.items() if name in known}  # what is held may be of a further law
        free = self._free(friction, more, begin)
        with one_thread():
            return self._valleys.from_start(begin, free).p

    def fit(self, friction: str, more: Sequence[str], p: dict[str, float]) -> ServoFit:
        """Return the fit of all runs, in fine steps; raise IdentificationError if it explains nothing."""
        return self.last(friction, self._free(friction, more, p), p)

    def last(self, friction: str, free: tuple[str, ...], p: Mapping[str, float]) -> ServoFit:
        """Return the fit of all runs with parameters that are free, in fine steps."""
        step = (FINE if self._few else MEDIUM) * self._excitation.T
        with one_thread():
            loop = ServoLoop(self._servo, self._whole, step, count_of(self._servo, self._whole))
            found, contrast = self._valleys.refined(loop, p, free, many=not self._few)
            # At rest, rounded positions change by a count or not at all: what parameters do to them shows without rounding.
            exact = ServoLoop(self._servo, self._whole, step)
            unrounded = self._valleys.at(exact, found, free)
            fit = ServoFit(self._servo, friction, free, unrounded, exact, self._excitation, contrast)
            require_explained(fit)
            require_scale(fit)
        return fit

    def _free(self, friction: str, more: Sequence[str], begin: Mapping[str, float]) -> tuple[str, ...]:
        """Return the parameters that are searched for, in the order of `SERVO_PARAMETERS`."""
        names = {"a", "b", "Ia", "Fs", "offset", "delay", *SERVO_FRICTIONS[friction], *more}
        names |= {"Fv"} if self._excitation.off else set()
        names -= set() if self._excitation.tilts else {"offset"}
        names |= {"rate"} if "rate" in begin else set()
        return tuple(name for name in SERVO_PARAMETERS if name in names - set(self.held))


def looked_at(servo: Servo, runs: Sequence[ServoRun], delay: float) -> list[ServoRun]:
    """Return runs, or their pieces, that a search looks at, commands being as late as its start says [s]."""
    whole = _evenly(runs)
    return whole if len(whole) > FEW else [piece for run in whole for piece in pieces(run, servo.step, 1.5 * delay)]


def _started(servo: Servo, runs: Sequence[ServoRun], held: dict[str, float], excitation: Excitation) -> dict[str, float]:
    """Return the start of the rows whose simulation fits best."""
    starts = ServoRows(servo, runs, held).starts()[:TRIED]
    if not starts:
        raise IdentificationError(
            f"{runs[0].name}: more duty does not make more torque in the direction of the command; has the command the "
            "sign and the unit of the position, and is it the one that the servo received?"
        )
    loop = ServoLoop(servo, runs, COARSE * excitation.T)
    lanes = {name: np.array([p[name] for p in starts]) for name in starts[0]} | {"Fv": np.zeros(len(starts))}
    cost = Search(loop, (), excitation.scales, excitation.range / 10).cost(loop.simulate(lanes))
    best = {**starts[int(cost.argmin())], "Fv": 0.0}
    if not np.isfinite(best["rate"]):
        del best["rate"]
    return {**best, "offset": best["offset"] * excitation.tilts, **held}


def _play(servo: Servo, loop: ServoLoop, begin: dict[str, float]) -> float:
    """Return the backlash of some that fits best: where there is none to begin with, its sensitivity is none."""
    tried = servo.step * PLAYS
    r = np.abs(loop.q - loop.simulate({name: np.full(len(tried), x) for name, x in begin.items()} | {"backlash": tried}))
    return float(tried[int((r * loop.kept).mean(axis=(1, 2)).argmin())])


def _evenly(runs: Sequence[ServoRun]) -> list[ServoRun]:
    stride = -(-len(runs) // MOST_RUNS)
    # a shift a block, so that no factor of a table of runs falls together with the stride
    return [runs[i] for i in (k * stride + k % stride for k in range(len(runs) // stride))]
