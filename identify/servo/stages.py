"""The stages of a servo's identification: from rows to the closed loop, with more parameters and in finer steps."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from itertools import product
from typing import Self

import numpy as np

from idbench.identify.errors import ExcitationError, IdentificationError
from idbench.identify.servo.closed_loop import ServoLoop, count_of
from idbench.identify.servo.excitation import Excitation
from idbench.identify.servo.fit import OTHER_SCALE, TORQUES, ServoFit, require_possible
from idbench.identify.servo.parameters import (
    FURTHER,
    SERVO_FRICTIONS,
    SERVO_PARAMETERS,
    SIMPLER,
    parameters_of,
    start_parameters,
)
from idbench.identify.servo.rows import ServoRows
from idbench.identify.servo.run import ServoRun, pieces
from idbench.identify.servo.search import SETTLED, Found, ServoSearch
from idbench.identify.telling import one_thread

RESTARTS = 2  # Times that a search leaves its valley for others, at most
SCALES = (0.7, 1.0, 1.4)  # Factors on all torques that are tried from there
ROTORS = (0.25, 1.0, 4.0)  # Further factors on the armature that are tried
LATER = (-2.0, -1.0, -0.5, 0.0, 0.5, 1.0, 2.0)  # Changes of the delay that are tried [samples]
VALLEYS = 3  # Other valleys that are searched
ESCAPED = 0.01  # Share by which another valley must be better
ASIDE = 8  # Rounds in another valley of the last stage, at most
NEAR = 1.1, 1.03  # Factors on all torques by which the last stage goes along the valley

NARROW = 3.0
"""Contrast below which it does: the valley is so long there that a search of all parameters ended 5 % from the best scale."""

ROUNDS = 30  # Rounds of the first stages, at most
REFINED = 15  # Rounds of the last stage, at most

Others = Callable[[ServoSearch, Found], list[dict[str, float]]]
"""Returns parameters elsewhere than where a search ended."""


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
    """Stages of a fit: closed-loop simulations with more parameters, and in finer steps, from stage to stage.

    The first begins at the initial parameters. Runs are to be cut where the joint rests, or have been.
    """

    def __init__(
        self, runs: Sequence[ServoRun], held: Mapping[str, float], initial: Mapping[str, float], cut: bool = True
    ) -> None:
        self._excitation = Excitation.of(runs, held)
        self._held = dict(held) if self._excitation.loaded else {"a": 1.0, **held}
        self._initial, self._few = dict(initial), len(_evenly(runs)) <= FEW or not cut
        self._whole = searched_runs(runs, initial["delay"]) if cut else list(runs)
        self._simulated = self._whole[0].servo.steps.step  # of a simulation, whose steps are then ours
        coarse = self._simulated or max(COARSE * self._excitation.T, 2 * STEP)
        self._coarse = ServoLoop(self._whole if self._few else self._whole[::2], coarse)
        self._rough = dict[str, dict[str, float]]()

    @classmethod
    @one_thread()
    def start(cls, runs: Sequence[ServoRun], more: Sequence[str], held: Mapping[str, float]) -> Self:
        """Stages that begin at the linear estimate whose closed loop fits best."""
        require_possible(held)
        held = {name: x for name, x in runs[0].servo.held.items() if name not in more} | dict(held) if runs else held
        excitation, some = Excitation.of(runs, held), _evenly(runs)
        if "Fo" in more and not excitation.off:
            raise ExcitationError(f"{runs[0].name}: Fo is unidentifiable, because torque is never off in a motion")
        return cls(runs, held, _first_estimate(some, held if excitation.loaded else {"a": 1.0, **held}, excitation))

    def fit(self, friction: str, more: Sequence[str] = ()) -> ServoFit:
        """Fit of all runs with a law of friction and further parameters, from the simpler laws on."""
        p = self._fit_law(friction, more) if more else self._rough_law(friction)
        return self.fit_fine(friction, self._free(friction, more, p), p)

    def _rough_law(self, friction: str) -> dict[str, float]:
        """Coarse parameters with a law of friction, fitted once."""
        if friction not in self._rough:
            self._rough[friction] = self._fit_law(friction, ())
        return self._rough[friction]

    @one_thread()
    def _fit_law(self, friction: str, more: Sequence[str]) -> dict[str, float]:
        """Coarse parameters with a law of friction and further ones, from those of the simpler law.

        p = argmin cost, again from other starts until cost(k+1) > (1 - ESCAPED) cost(k).
        """
        p = self._rough_law(SIMPLER[friction]) if friction in SIMPLER else self._initial
        more = (*more, *self._usual)
        first = start_parameters(friction, p, self._excitation.speed) | dict.fromkeys(more, 0.0)
        begin = {**first, **p, **self._held}
        if "backlash" in more and "backlash" not in {**p, **self._held}:  # without any, its sensitivity is none
            loop, tried = self._coarse, self._coarse.runs[0].still * PLAYS
            q = loop.simulate({name: np.full(len(tried), x) for name, x in begin.items()} | {"backlash": tried})
            begin["backlash"] = float(tried[int((np.abs(loop.q - q) * loop.kept).mean(axis=(1, 2)).argmin())])
        known = {*parameters_of(friction, more), *(name for name in self._held if name in FURTHER)}
        begin = {name: x for name, x in begin.items() if name in known}  # what is held may be of a further law
        free = self._free(friction, more, begin)
        found = self._search(self._coarse, begin, free).best(begin, ROUNDS)
        return self._escaped(self._coarse, free, found, self._restart_points, ROUNDS).p

    @one_thread()
    def fit_with_extra(
        self, free: Sequence[str], p: Mapping[str, float], tried: Sequence[str], rounds: int
    ) -> dict[str, Found]:
        """Coarse fits with each of further parameters, and without any (as "")."""
        every = {"": (p, tuple(free))} | {name: ({**p, name: 0.0}, (*free, name)) for name in tried}
        return {name: self._search(self._coarse, q, some).best(q, rounds) for name, (q, some) in every.items()}

    @one_thread()
    def fit_fine(
        self, friction: str, free: Sequence[str], p: Mapping[str, float], contrasts: tuple[float, float] | None = None
    ) -> ServoFit:
        """Fit of all runs in fine steps.

        With contrasts (see `ServoFit`) that are known, from an earlier fit, no other valley is tried.
        """
        step = self._simulated or max((FINE if self._few else MEDIUM) * self._excitation.T, STEP)
        loop = ServoLoop(self._whole, step, count_of(self._whole))
        found = self._search(loop, p, free).best(p, REFINED)
        if contrasts is None:
            found, contrasts = self._refined(loop, free, found)
        # At rest, rounded positions change by a count or not at all: what parameters do to them shows without rounding.
        exact = ServoLoop(self._whole, step)
        unrounded = self._search(exact, found.p, free).at(found)
        contrasts = contrasts if self._excitation.loaded else (1.0, 1.0)
        return ServoFit(friction, tuple(free), unrounded, exact, self._excitation, contrasts)

    def _refined(self, loop: ServoLoop, free: Sequence[str], found: Found) -> tuple[Found, tuple[float, float]]:
        """Best fit in the steps of the loop from other valleys, with its contrasts (see `ServoFit`)."""
        if self._few:
            found = self._escaped(loop, free, found, ServoSearch.axis_points, ASIDE)
        if "a" not in free:
            return found, (np.inf, np.inf)
        if not self._few:  # on a real bench, a scale that fitted 1 % better predicted another mass 8 % worse
            return found, self._scaled(free, found.p)[1]
        found, contrasts = self._of_scale(loop, free, found)
        return self._along(loop, free, found) if min(contrasts) < NARROW else found, contrasts

    def _restart_points(self, search: ServoSearch, found: Found) -> list[dict[str, float]]:
        """Parameters in other valleys: a rotor that is light looks like a command that is late."""
        T, base = self._excitation.T, {**found.p, "Ia": max(found.p["Ia"], found.p["b"] * self._excitation.T / 2)}
        tried = []
        scales = SCALES if "a" in search.free else (1.0,)  # torques that are known have one
        for scale, Ia, delay, offset in product(scales, ROTORS, LATER, {base["offset"], 0.0}):
            torques = {name: x * scale for name, x in base.items() if name in TORQUES}
            late = base["delay"] + delay * T
            tried.append({**base, **torques, "Ia": base["Ia"] * Ia, "delay": late, "offset": offset, **self._held})
        return [dict(each) for each in {tuple(other.items()): None for other in tried} if dict(each) != base]

    def _escaped(self, loop: ServoLoop, free: Sequence[str], found: Found, others: Others, rounds: int) -> Found:
        """Best of searches from the likeliest of other places, while cost(k+1) < (1 - ESCAPED) cost(k)."""
        for _ in range(RESTARTS):
            search = self._search(loop, found.p, free)
            tried = others(search, found)
            cost = search.cost(loop.simulate({name: np.array([x[name] for x in tried]) for name in found.p}))
            best = min((search.best(tried[int(k)], rounds) for k in np.argsort(cost)[:VALLEYS]), key=lambda other: other.cost)
            if best.cost > (1 - ESCAPED) * search.at(found).cost:
                break
            found = best
        return found

    def _along(self, loop: ServoLoop, free: Sequence[str], found: Found) -> Found:
        """Best fit along p(f) = f p, f of all torques: in a narrow valley a search of all parameters ends early."""
        search = self._search(loop, found.p, free)
        others, best, cost = search.without("a"), found.p, search.at(found).cost
        for factor in (near**sign for near in NEAR for sign in (1, -1)):
            while (other := others.best(self._times(factor, free, best), ASIDE)).cost < (1 - SETTLED) * cost:
                best, cost = other.p, other.cost
        return found if best is found.p else search.best(best, REFINED)

    def _of_scale(self, loop: ServoLoop, free: Sequence[str], found: Found) -> tuple[Found, tuple[float, float]]:
        """Best of searches from p(f) = f p, and the contrasts cost(f p) / cost(p) (see `ServoFit`)."""
        scaled, contrasts = self._scaled(free, found.p)
        for _ in range(RESTARTS):
            if min(contrasts) > 1 - ESCAPED:
                break
            search = self._search(loop, scaled, free)
            other = search.best(scaled, REFINED)
            if other.cost > (1 - ESCAPED) * search.at(found).cost:
                break
            found = other
            scaled, contrasts = self._scaled(free, found.p)
        return found, contrasts

    def _scaled(self, free: Sequence[str], p: Mapping[str, float]) -> tuple[dict[str, float], tuple[float, float]]:
        """Best parameters with another torque per volt, and by what less and more of it raise the objective."""
        search = self._search(self._coarse, p, free)
        others = search.without("a")
        less, more = (others.best(self._times(factor, free, p), ASIDE) for factor in (1 / OTHER_SCALE, OTHER_SCALE))
        cost = search.best(p, ASIDE).cost
        return min((less, more), key=lambda other: other.cost).p, (less.cost / cost, more.cost / cost)

    def _times(self, factor: float, free: Sequence[str], p: Mapping[str, float]) -> dict[str, float]:
        """Parameters with torques of another scale; where gravity is free, it and the armature make up for the load."""
        scaled = {**p, **{name: p[name] * factor for name in TORQUES if name in free}}
        if "Flq" in free:
            scaled["Flq"] = p["Flq"] / factor
        if "Mg" in free:
            loads = [run.load for run in self._coarse.runs]
            J, sine = (float(np.mean([np.mean(getattr(load, x)) for load in loads])) for x in ("inertia", "sine"))
            scaled["Mg"] = factor * (p["Mg"] + sine) - sine
            scaled["Ia"] = max(factor * (p["Ia"] + J) - J, 0.1 * p["Ia"]) if "Ia" in free else p["Ia"]
        return scaled

    def _search(self, loop: ServoLoop, p: Mapping[str, float], free: Sequence[str]) -> ServoSearch:
        """Search near parameters: Fair's scale is three times their median residual."""
        r = np.abs(loop.q - loop.simulate(p)[0])[loop.kept]
        return ServoSearch(loop, tuple(free), self._excitation.scales, 3 * max(float(np.median(r)), loop.step / 4))

    @property
    def _usual(self) -> tuple[str, ...]:
        """What is found of a loop of torques unasked: where gravity shows its zero, it shows a constant torque as well."""
        return ("bias",) if self._whole[0].servo.kind == "torque" and self._excitation.tilts else ()

    def _free(self, friction: str, more: Sequence[str], p: Mapping[str, float]) -> tuple[str, ...]:
        """Parameters that are searched for, in the order of `SERVO_PARAMETERS`."""
        names = {"a", "b", "Ia", "Fs", "offset", "delay", *SERVO_FRICTIONS[friction], *more, *self._usual}
        names |= {"Fv"} if self._excitation.off or "b" in self._held else set()
        names -= set() if self._excitation.tilts else {"offset"}
        names |= {"rate"} if "rate" in p else set()
        return tuple(name for name in SERVO_PARAMETERS if name in names - set(self._held))


def searched_runs(runs: Sequence[ServoRun], delay: float) -> list[ServoRun]:
    """Runs, or their pieces, that a search looks at, commands being as late as its start says [s]."""
    whole = _evenly(runs)
    return whole if len(whole) > FEW else [piece for run in whole for piece in pieces(run, 1.5 * max(delay, 0.0))]


def _first_estimate(runs: Sequence[ServoRun], held: Mapping[str, float], excitation: Excitation) -> dict[str, float]:
    """Start of the rows whose simulation fits best; raise IdentificationError if the command has the other sign."""
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


def _best_start(runs: Sequence[ServoRun], held: Mapping[str, float], excitation: Excitation) -> tuple[dict[str, float], float]:
    """Start of the rows that fits best, and its mean residual over the range; nothing if there is none."""
    starts = ServoRows(runs, held).starts()[:TRIED]
    if not starts:
        return {}, np.inf
    loop = ServoLoop(runs, runs[0].servo.steps.step or max(COARSE * excitation.T, 2 * STEP))
    q = loop.simulate({name: np.array([p[name] for p in starts]) for name in starts[0]})
    best = int(ServoSearch(loop, (), excitation.scales, excitation.range / 10).cost(q).argmin())
    return dict(starts[best]), float(np.abs(loop.q - q[best])[loop.kept].mean()) / excitation.range


def _evenly(runs: Sequence[ServoRun]) -> list[ServoRun]:
    stride = -(-len(runs) // MOST_RUNS)
    # a shift a block, so that no factor of a table of runs falls together with the stride
    return [runs[i] for i in (k * stride + k % stride for k in range(len(runs) // stride))]
