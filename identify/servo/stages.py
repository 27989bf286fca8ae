"""The stages of a servo's identification: from rows to the closed loop, with more parameters and in finer steps."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Self

import numpy as np

from idbench.identify.errors import ExcitationError, IdentificationError
from idbench.identify.servo.closed_loop import ServoLoop, count_of
from idbench.identify.servo.excitation import Excitation
from idbench.identify.servo.fit import ServoFit, require_possible
from idbench.identify.servo.parameters import FURTHER, SERVO_FRICTIONS, SERVO_PARAMETERS, parameters_of, start_parameters
from idbench.identify.servo.rows import ServoRows
from idbench.identify.servo.run import ServoRun, pieces
from idbench.identify.servo.search import Found, ServoSearch
from idbench.identify.servo.valleys import Valleys
from idbench.identify.telling import one_thread

TRIED = 48  # Starts of the rows that are simulated
FEW = 20  # Runs of which all are looked at from the beginning, in pieces that are simulated side by side; many are whole
MOST_RUNS = 120  # Runs that a search looks at; of more, as many evenly spread ones
COARSE = 0.4  # Longest step of the first stages, as a share of the sampling time
MEDIUM = 0.2  # Longest step of the last stage with whole runs
FINE = 0.1  # Longest step of the last stage with pieces
MISLED = 0.2  # Mean residual of a start, over the range of the motion, from which on commands are tried with the other sign
STEP = 1e-3  # Shortest step of the last stage [s]: a tenth of the sampling time of 100 Hz, at which the benches were identified
PLAYS = np.array([0.5, 1.0, 2.0, 4.0, 8.0, 16.0, 32.0])  # Backlash that is tried first [counts]


class Stages:
    """Runs at work: from stage to stage with more parameters, and finer.

    Parameters
    ----------
    runs, held
        As for `identify_servo`.
    start : mapping of str to float
        Parameters of the first stage.
    cut : bool
        Whether runs are cut where the joint rests; they have been if not.
    """

    def __init__(self, runs: Sequence[ServoRun], held: dict[str, float], start: Mapping[str, float], cut: bool = True) -> None:
        self._excitation = Excitation.of(runs, held)
        self.held = held if self._excitation.loaded else {"a": 1.0} | held
        self.start, self._few = dict(start), len(_evenly(runs)) <= FEW or not cut
        self._whole = searched_runs(runs, self.start["delay"]) if cut else list(runs)
        self._simulated = self._whole[0].servo.steps.step  # of a simulation, whose steps are then ours
        coarse = self._simulated or max(COARSE * self._excitation.T, 2 * STEP)
        self._coarse = ServoLoop(self._whole if self._few else self._whole[::2], coarse)
        self._valleys = Valleys(self._coarse, self._excitation, self.held)

    @classmethod
    def begun(cls, runs: Sequence[ServoRun], more: Sequence[str], held: dict[str, float]) -> Self:
        """Return stages that begin with the start of the rows whose simulation fits best."""
        require_possible(held)
        held = {name: x for name, x in runs[0].servo.held.items() if name not in more} | held if runs else held
        excitation, some = Excitation.of(runs, held), _evenly(runs)
        if "Fo" in more and not excitation.off:
            raise ExcitationError(f"{runs[0].name}: Fo is unidentifiable, because torque is never off in a motion")
        with one_thread():
            return cls(runs, held, _started(some, held if excitation.loaded else {"a": 1.0} | held, excitation))

    def go(self, friction: str, more: Sequence[str], p: Mapping[str, float]) -> dict[str, float]:
        """Return the parameters with a law of friction and further ones, from those of a simpler law."""
        more = (*more, *self._usual)
        first = start_parameters(friction, p, self._excitation.speed) | dict.fromkeys(more, 0.0)
        begin = {**first, **p, **self.held}
        if "backlash" in more and "backlash" not in {**p, **self.held}:
            begin["backlash"] = _play(self._coarse, begin)
        known = {*parameters_of(friction, more), *(name for name in self.held if name in FURTHER), *self._usual}
        begin = {name: x for name, x in begin.items() if name in known}  # what is held may be of a further law
        free = self._free(friction, more, begin)
        with one_thread():
            return self._valleys.from_start(begin, free).p

    def beside(self, free: tuple[str, ...], p: Mapping[str, float], tried: Sequence[str], rounds: int) -> dict[str, Found]:
        """Return what is found in coarse steps with each of further parameters, and without (as "")."""
        with one_thread():
            found = {"": self._valleys.near(p, free, rounds)}
            return found | {name: self._valleys.near({**p, name: 0.0}, (*free, name), rounds) for name in tried}

    def fit(self, friction: str, more: Sequence[str], p: dict[str, float]) -> ServoFit:
        """Return the fit of all runs, in fine steps."""
        return self.last(friction, self._free(friction, more, p), p)

    def last(
        self,
        friction: str,
        free: tuple[str, ...],
        p: Mapping[str, float],
        contrasts: tuple[float, float] | None = None,
    ) -> ServoFit:
        """Return the fit of all runs with parameters that are free, in fine steps.

        With contrasts (see `ServoFit`) that are known, from an earlier fit, no other valley is tried.
        """
        step = self._simulated or max((FINE if self._few else MEDIUM) * self._excitation.T, STEP)
        with one_thread():
            loop = ServoLoop(self._whole, step, count_of(self._whole))
            if contrasts is None:
                found, contrasts = self._valleys.refined(loop, p, free, many=not self._few)
            else:
                found = self._valleys.again(loop, p, free)
            # At rest, rounded positions change by a count or not at all: what parameters do to them shows without rounding.
            exact = ServoLoop(self._whole, step)
            unrounded = self._valleys.at(exact, found, free)
        if not self._excitation.loaded:
            contrasts = 1.0, 1.0
        return ServoFit(friction, free, unrounded, exact, self._excitation, contrasts)

    @property
    def _usual(self) -> tuple[str, ...]:
        """What is found of a loop of torques unasked: where gravity shows its zero, it shows a constant torque as well."""
        return ("bias",) if self._whole[0].servo.kind == "torque" and self._excitation.tilts else ()

    def _free(self, friction: str, more: Sequence[str], begin: Mapping[str, float]) -> tuple[str, ...]:
        """Return the parameters that are searched for, in the order of `SERVO_PARAMETERS`."""
        names = {"a", "b", "Ia", "Fs", "offset", "delay", *SERVO_FRICTIONS[friction], *more, *self._usual}
        names |= {"Fv"} if self._excitation.off or "b" in self.held else set()
        names -= set() if self._excitation.tilts else {"offset"}
        names |= {"rate"} if "rate" in begin else set()
        return tuple(name for name in SERVO_PARAMETERS if name in names - set(self.held))


def searched_runs(runs: Sequence[ServoRun], delay: float) -> list[ServoRun]:
    """Return runs, or their pieces, that a search looks at, commands being as late as its start says [s]."""
    whole = _evenly(runs)
    return whole if len(whole) > FEW else [piece for run in whole for piece in pieces(run, 1.5 * max(delay, 0.0))]


def _started(runs: Sequence[ServoRun], held: dict[str, float], excitation: Excitation) -> dict[str, float]:
    """Return the start of the rows whose simulation fits best; raise IdentificationError if the command has the other sign."""
    best, cost = _best_start(runs, held, excitation)
    turned = [replace(run, command=-run.command, forward=None if run.forward is None else -run.forward) for run in runs]
    if cost > MISLED and _best_start(turned, held, excitation)[1] < cost / 2:
        raise IdentificationError(
            f"{runs[0].name}: the joint follows its command with the other sign: turn the sign of the command, or of the "
            "position and the joint's axis in the robot's file"
        )
    if not best:
        raise IdentificationError(
            f"{runs[0].name}: more duty does not make more torque in the direction of the command; is it the one that the "
            "servo received, in the unit of the position?"
        )
    if not np.isfinite(best["rate"]):
        del best["rate"]
    return {**best, "offset": best["offset"] * excitation.tilts, **held}


def _best_start(runs: Sequence[ServoRun], held: dict[str, float], excitation: Excitation) -> tuple[dict[str, float], float]:
    """Return the start of the rows that fits best, and its mean residual over the range; nothing if there is none."""
    starts = ServoRows(runs, held).starts()[:TRIED]
    if not starts:
        return {}, np.inf
    loop = ServoLoop(runs, runs[0].servo.steps.step or max(COARSE * excitation.T, 2 * STEP))
    lanes = {name: np.array([p[name] for p in starts]) for name in starts[0]}
    q = loop.simulate(lanes)
    best = int(ServoSearch(loop, (), excitation.scales, excitation.range / 10).cost(q).argmin())
    return dict(starts[best]), float(np.abs(loop.q - q[best])[loop.kept].mean()) / excitation.range


def _play(loop: ServoLoop, begin: dict[str, float]) -> float:
    """Return the backlash of some that fits best: where there is none to begin with, its sensitivity is none."""
    tried = loop.runs[0].still * PLAYS
    r = np.abs(loop.q - loop.simulate({name: np.full(len(tried), x) for name, x in begin.items()} | {"backlash": tried}))
    return float(tried[int((r * loop.kept).mean(axis=(1, 2)).argmin())])


def _evenly(runs: Sequence[ServoRun]) -> list[ServoRun]:
    stride = -(-len(runs) // MOST_RUNS)
    # a shift a block, so that no factor of a table of runs falls together with the stride
    return [runs[i] for i in (k * stride + k % stride for k in range(len(runs) // stride))]
