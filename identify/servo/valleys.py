"""Searches for the parameters of a servo that leave the valley where they are."""

from collections.abc import Mapping, Sequence
from itertools import product

import numpy as np

from idbench.identify.servo.closed_loop import ServoLoop
from idbench.identify.servo.excitation import Excitation
from idbench.identify.servo.fit import OTHER_SCALE, TORQUES
from idbench.identify.servo.search import SETTLED, Found, ServoSearch

SHAKEN = 2  # Times that a search leaves its valley for others, at most
SCALES = (0.7, 1.0, 1.4)  # Factors on all torques that are tried from there
ROTORS = (0.25, 1.0, 4.0)  # Further factors on the armature that are tried
LATER = (-2.0, -1.0, -0.5, 0.0, 0.5, 1.0, 2.0)  # Changes of the delay that are tried [samples]
VALLEYS = 3  # Other valleys that are searched
ESCAPED = 0.01  # Share by which another valley must be better
ASIDE = 8  # Rounds in another valley of the last stage, at most
NEAR = 1.1, 1.03  # Factors on all torques by which the last stage goes along the valley

NARROW = 3.0
"""Contrast below which it does: the valley is so long there that a search of all parameters ended 5 % from the best scale."""

REFINED = 15  # Rounds of the last stage, at most


class Valleys:
    """Searches that leave the valley where they are, if another one is deeper.

    Parameters
    ----------
    coarse : ServoLoop
        Runs in coarse steps, in which other valleys are looked for.
    excitation : Excitation
        What the runs can show.
    held : mapping of str to float
        Parameters that are known.
    """

    def __init__(self, coarse: ServoLoop, excitation: Excitation, held: Mapping[str, float]) -> None:
        self._coarse = coarse
        self._excitation = excitation
        self._held = dict(held)

    def from_start(self, p: Mapping[str, float], free: Sequence[str]) -> Found:
        """Return p = argmin cost in coarse steps, again from shaken starts, until cost(k+1) > (1 - ESCAPED) cost(k)."""
        found = self._search(self._coarse, p, free).best(p)
        for _ in range(SHAKEN):
            search = self._search(self._coarse, found.p, free)
            best = min((search.best(other) for other in self._shaken(search, found.p)), key=lambda other: other.cost)
            if best.cost > (1 - ESCAPED) * search.at(found).cost:
                break
            found = best
        return found

    def near(self, p: Mapping[str, float], free: Sequence[str], rounds: int) -> Found:
        """Return what a search finds from a place in coarse steps, without leaving its valley."""
        return self._search(self._coarse, p, free).best(p, rounds)

    def refined(
        self, loop: ServoLoop, p: Mapping[str, float], free: Sequence[str], many: bool
    ) -> tuple[Found, tuple[float, float]]:
        """Return what is found in the steps of a loop, and its contrasts (see `ServoFit`)."""
        found = self.again(loop, p, free)
        if "a" not in free:
            return found if many else self._better(loop, free, found), (np.inf, np.inf)
        if many:  # on a real bench, a scale that fitted 1 % better predicted another mass 8 % worse
            return found, self._scaled(free, found.p)[1]
        found, contrasts = self._of_scale(loop, free, self._better(loop, free, found))
        return self._along(loop, free, found) if min(contrasts) < NARROW else found, contrasts

    def again(self, loop: ServoLoop, p: Mapping[str, float], free: Sequence[str]) -> Found:
        """Return what is found in the steps of a loop, without leaving the valley."""
        return self._search(loop, p, free).best(p, REFINED)

    def at(self, loop: ServoLoop, found: Found, free: Sequence[str]) -> Found:
        """Return residuals and sensitivities in another loop."""
        return self._search(loop, found.p, free).at(found)

    def _shaken(self, search: ServoSearch, p: dict[str, float]) -> list[dict[str, float]]:
        """Return the best of parameters in other valleys: a rotor that is light looks like a command that is late."""
        base = {**p, "Ia": max(p["Ia"], p["b"] * self._excitation.T / 2)}
        T, held = self._excitation.T, self._held
        tried = []
        scales = SCALES if "a" in search.free else (1.0,)  # torques that are known have one
        for scale, Ia, delay, offset in product(scales, ROTORS, LATER, {base["offset"], 0.0}):
            torques = {name: x * scale for name, x in base.items() if name in TORQUES}
            late = base["delay"] + delay * T
            tried.append({**base, **torques, "Ia": base["Ia"] * Ia, "delay": late, "offset": offset, **held})
        tried = [dict(each) for each in {tuple(other.items()): None for other in tried} if dict(each) != base]
        lanes = {name: np.array([x[name] for x in tried]) for name in base}
        order = np.argsort(search.cost(self._coarse.simulate(lanes)))[:VALLEYS]
        return [tried[int(k)] for k in order]

    def _better(self, loop: ServoLoop, free: Sequence[str], found: Found) -> Found:
        """Return the best of searches from p +- sigma v, v the worst known axes, while cost(k+1) < (1 - ESCAPED) cost(k)."""
        for _ in range(SHAKEN):
            search = self._search(loop, found.p, free)
            tried = search.away(found)
            cost = search.cost(loop.simulate({name: np.array([x[name] for x in tried]) for name in tried[0]}))
            best = min((search.best(tried[int(k)], ASIDE) for k in np.argsort(cost)[:VALLEYS]), key=lambda other: other.cost)
            if best.cost > (1 - ESCAPED) * search.at(found).cost:
                break
            found = best
        return found

    def _along(self, loop: ServoLoop, free: Sequence[str], found: Found) -> Found:
        """Return the best along p(f) = f p, f of all torques: in a narrow valley a search of all parameters ends early."""
        search = self._search(loop, found.p, free)
        others = ServoSearch(loop, [name for name in free if name != "a"], self._excitation.scales, search.c)
        best, cost = found.p, search.at(found).cost
        for factor in (near**sign for near in NEAR for sign in (1, -1)):
            while (other := others.best(self._times(factor, free, best), ASIDE)).cost < (1 - SETTLED) * cost:
                best, cost = other.p, other.cost
        return found if best is found.p else search.best(best, REFINED)

    def _of_scale(self, loop: ServoLoop, free: Sequence[str], found: Found) -> tuple[Found, tuple[float, float]]:
        """Return the best of searches from p(f) = f p, and the contrasts cost(f p) / cost(p) (see `ServoFit`)."""
        scaled, contrasts = self._scaled(free, found.p)
        for _ in range(SHAKEN):
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
        """Return the best parameters with another torque per volt, and by what less and more of it raise the objective."""
        search = self._search(self._coarse, p, free)
        others = ServoSearch(self._coarse, [name for name in free if name != "a"], self._excitation.scales, search.c)
        less, more = (others.best(self._times(factor, free, p), ASIDE) for factor in (1 / OTHER_SCALE, OTHER_SCALE))
        cost = search.best(p, ASIDE).cost
        return min((less, more), key=lambda other: other.cost).p, (less.cost / cost, more.cost / cost)

    def _times(self, factor: float, free: Sequence[str], p: Mapping[str, float]) -> dict[str, float]:
        """Return parameters with torques of another scale; where gravity is free, it and the armature make up for the load."""
        scaled = {**p, **{name: p[name] * factor for name in TORQUES if name in free}}
        if "Flq" in free:
            scaled["Flq"] = p["Flq"] / factor
        if "Mg" in free:
            J, sine = (
                float(np.mean([np.mean(getattr(run.load, x)) for run in self._coarse.runs])) for x in ("inertia", "sine")
            )
            scaled["Mg"] = factor * (p["Mg"] + sine) - sine
            scaled["Ia"] = max(factor * (p["Ia"] + J) - J, 0.1 * p["Ia"]) if "Ia" in free else p["Ia"]
        return scaled

    def _search(self, loop: ServoLoop, begin: Mapping[str, float], free: Sequence[str]) -> ServoSearch:
        r = np.abs(loop.q - loop.simulate(begin)[0])[loop.kept]
        c = 3 * max(float(np.median(r)), loop.step / 4)
        return ServoSearch(loop, free, self._excitation.scales, c)
