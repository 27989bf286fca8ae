"""The identification of a servo: rows, then the closed loop, law by law and finer from stage to stage."""

from collections.abc import Mapping, Sequence
from itertools import product
from typing import Self, final

import numpy as np

from identify.errors import ExcitationError, IdentificationError
from identify.one_thread import one_thread
from identify.servo.closed_loop import ServoLoop, count_of
from identify.servo.excitation import Excitation
from identify.servo.fit import ServoFit
from identify.servo.friction import SERVO_FRICTIONS, first_of, simpler
from identify.servo.parameters import FURTHER, SERVO_PARAMETERS, parameters_of
from identify.servo.pieces import pieces
from identify.servo.refusals import OTHER_SCALE, SCALE_SETTERS, TORQUES, require_explained, require_possible, require_scale
from identify.servo.rows import ServoRows
from identify.servo.run import ServoRun
from identify.servo.search import Found, Search
from identify.servo.servo import Servo

TRIED = 48
"""Starts of the rows that are simulated."""

FEW = 20
"""Runs of which all are looked at from the beginning, in pieces that are simulated side by side; many are whole."""

MOST_RUNS = 120
"""Runs that a search looks at; of more, as many evenly spread ones."""

COARSE, MEDIUM, FINE = 0.4, 0.2, 0.1
"""Longest steps, as shares of the sampling time: of first stages, of the last with whole runs, and with pieces."""

SHAKEN = 2
"""Times that a search leaves its valley for others, at most."""

SCALES, ROTORS, LATER = (0.7, 1.0, 1.4), (0.25, 1.0, 4.0), (-2.0, -1.0, -0.5, 0.0, 0.5, 1.0, 2.0)
"""Factors on all torques, further ones on the armature, and changes of the delay [samples] that are tried from there."""

VALLEYS = 3
"""Other valleys that are searched."""

ESCAPED = 0.01
"""Share by which another valley must be better."""

ASIDE = 8
"""Rounds in another valley of the last stage, at most."""

REFINED = 15
"""Rounds of the last stage, at most."""

PLAYS = np.array([0.5, 1.0, 2.0, 4.0, 8.0, 16.0, 32.0])
"""Backlash that is tried first [counts]."""


def identify_servo(
    servo: Servo,
    runs: Sequence[ServoRun],
    friction: str = "load",
    more: Sequence[str] = (),
    held: dict[str, float] | None = None,
) -> ServoFit:
    """Return the parameters of a servo, from commands and positions alone.

    Rows that are linear in all but delay and rate limit make the start (`ServoRows`); the closed loop, simulated from the
    commands, is then fitted to the positions (`Search`): with the simpler laws of friction first, each the start of the next.

    Parameters
    ----------
    servo : Servo
        What is known.
    runs : sequence of ServoRun
        What was logged, with known loads.
    friction : str
        A law of `SERVO_FRICTIONS`.
    more : sequence of str
        Further parameters to be found, of `FURTHER`.
    held : dict of str to float, optional
        Parameters that are known, by their letters.

    Raises
    ------
    IdentificationError
        If nothing moves, torque is never on, duty always at its limit, or commands cannot explain the motion.
    SettingError
        If a name is unknown.
    """
    parameters_of(friction, (*more, *(held or {})))
    stages = Stages.begun(servo, runs, held or {})
    stages.require_shown(more)
    p = stages.start
    for law in simpler(friction):
        p = stages.go(law, (), p)
    return stages.fit(friction, more, stages.go(friction, more, p))


def identify_again(fit: ServoFit, runs: Sequence[ServoRun]) -> ServoFit:
    """Return the fit of the same parameters, from where it is, to runs whose loads are known better.

    Raises
    ------
    IdentificationError
        As for `identify_servo`.
    """
    held = {name: x for name, x in fit.p.items() if name not in fit.free}
    return Stages(fit.servo, runs, held, fit.p).last(fit.friction, fit.free, fit.p)


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
        whole, self.start = _evenly(runs), dict(start)
        self._few = len(whole) <= FEW
        some = whole[::2]
        if self._few:
            whole = some = [piece for run in whole for piece in pieces(run, servo.step, 1.5 * self.start["delay"])]
        self._whole, self._coarse = whole, ServoLoop(servo, some, COARSE * self._excitation.T)

    @classmethod
    def begun(cls, servo: Servo, runs: Sequence[ServoRun], held: dict[str, float]) -> Self:
        """Return stages that begin with the start of the rows whose simulation fits best."""
        require_possible(held)
        excitation, some = Excitation.of(servo, runs, held), _evenly(runs)
        with one_thread():
            return cls(servo, runs, held, _started(servo, some, held, excitation))

    def require_shown(self, more: Sequence[str]) -> None:
        """Raise ExcitationError if runs cannot show a further parameter."""
        if "Fo" in more and not self._excitation.off:
            raise ExcitationError(
                f"{self._whole[0].name}: torque is never off in a motion, so that Fo does not show; leave it out"
            )

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
            found = self._search(self._coarse, begin, free).best(begin)
            for _ in range(SHAKEN):
                search = self._search(self._coarse, found.p, free)
                best = min((search.best(other) for other in self._shaken(search, found.p)), key=lambda other: other.cost)
                if best.cost > (1 - ESCAPED) * search.at(found).cost:
                    break
                found = best
        return found.p

    def _shaken(self, search: Search, p: dict[str, float]) -> list[dict[str, float]]:
        """Return the best of parameters in other valleys: a rotor that is light looks like a command that is late."""
        base = {**p, "Ia": max(p["Ia"], p["b"] * self._excitation.T / 2)}
        T, held = self._excitation.T, self.held
        tried = []
        for scale, Ia, delay, offset in product(SCALES, ROTORS, LATER, (base["offset"], 0.0)):
            torques = {name: x * scale for name, x in base.items() if name in TORQUES}
            late = max(base["delay"] + delay * T, 0.0)
            tried.append({**base, **torques, "Ia": base["Ia"] * Ia, "delay": late, "offset": offset, **held})
        tried = [dict(each) for each in {tuple(other.items()): None for other in tried} if dict(each) != base]
        lanes = {name: np.array([x[name] for x in tried]) for name in base}
        order = np.argsort(search.cost(self._coarse.simulate(lanes)))[:VALLEYS]
        return [tried[int(k)] for k in order]

    def fit(self, friction: str, more: Sequence[str], p: dict[str, float]) -> ServoFit:
        """Return the fit of all runs, in fine steps; raise IdentificationError if it explains nothing."""
        return self.last(friction, self._free(friction, more, p), p)

    def last(self, friction: str, free: tuple[str, ...], p: Mapping[str, float]) -> ServoFit:
        """Return the fit of all runs with parameters that are free, in fine steps."""
        step = (FINE if self._few else MEDIUM) * self._excitation.T
        with one_thread():
            loop = ServoLoop(self._servo, self._whole, step, count_of(self._servo, self._whole))
            found = self._search(loop, p, free).best(p, REFINED)
            if self._few:
                found = self._better(loop, free, found)
            found, contrast = self._of_scale(loop, free, found)
            # At rest, rounded positions change by a count or not at all: what parameters do to them shows without rounding.
            exact = ServoLoop(self._servo, self._whole, step)
            fit = ServoFit(
                self._servo, friction, free, self._search(exact, found.p, free).at(found), exact, self._excitation, contrast
            )
            require_explained(fit)
            require_scale(fit)
        return fit

    def _better(self, loop: ServoLoop, free: tuple[str, ...], found: Found) -> Found:
        """Return what is found from both sides of the axes that are known worst, if it is better."""
        for _ in range(SHAKEN):
            search = self._search(loop, found.p, free)
            tried = search.away(found)
            cost = search.cost(loop.simulate({name: np.array([x[name] for x in tried]) for name in tried[0]}))
            best = min((search.best(tried[int(k)], ASIDE) for k in np.argsort(cost)[:VALLEYS]), key=lambda other: other.cost)
            if best.cost > (1 - ESCAPED) * search.at(found).cost:
                break
            found = best
        return found

    def _of_scale(self, loop: ServoLoop, free: tuple[str, ...], found: Found) -> tuple[Found, float]:
        """Return what is found, from other scales of the torques if that is better, and its contrast (see `ServoFit`)."""
        if any(found.p[name] > 0 for name in SCALE_SETTERS if name not in free):
            return found, np.inf
        for _ in range(SHAKEN):
            scaled, contrast = self._scaled(free, found.p)
            if contrast > 1 - ESCAPED:
                break
            other = self._search(loop, scaled, free).best(scaled, REFINED)
            if other.cost > (1 - ESCAPED) * self._search(loop, scaled, free).at(found).cost:
                break
            found = other
        return found, contrast

    def _scaled(self, free: tuple[str, ...], p: Mapping[str, float]) -> tuple[dict[str, float], float]:
        """Return the best parameters with another torque per volt, and how many times larger they make the objective."""
        search = self._search(self._coarse, p, free)
        others = Search(self._coarse, [name for name in free if name != "a"], self._excitation.scales, search.c)
        torques = [name for name in TORQUES if name in free]
        starts = [{**p, **{name: p[name] * factor for name in torques}} for factor in (OTHER_SCALE, 1 / OTHER_SCALE)]
        best = min((others.best(start, ASIDE) for start in starts), key=lambda other: other.cost)
        return best.p, best.cost / search.best(p, ASIDE).cost

    def _search(self, loop: ServoLoop, begin: Mapping[str, float], free: Sequence[str]) -> Search:
        r = np.abs(loop.q - loop.simulate(begin)[0])[loop.kept]
        c = 3 * max(float(np.median(r)), self._servo.step / 4)
        return Search(loop, free, self._excitation.scales, c)

    def _free(self, friction: str, more: Sequence[str], begin: Mapping[str, float]) -> tuple[str, ...]:
        """Return the parameters that are searched for, in the order of `SERVO_PARAMETERS`."""
        names = {"a", "b", "Ia", "Fs", "offset", "delay", *SERVO_FRICTIONS[friction], *more}
        names |= {"Fv"} if self._excitation.off else set()
        names -= set() if self._excitation.tilts else {"offset"}
        names |= {"rate"} if "rate" in begin else set()
        return tuple(name for name in SERVO_PARAMETERS if name in names - set(self.held))


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
