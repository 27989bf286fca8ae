"""A fit, judged on each held-out log, made once; what it comes to in a sentence, and the next step."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from idbench.experiments.document import Conclusion
from idbench.experiments.errors import is_told, reason, trace
from idbench.experiments.identification.causes import Cause, remedy_of
from idbench.experiments.identification.consistent_robot import WrittenRobot
from idbench.experiments.identification.fit import Fit
from idbench.experiments.identification.log_warnings import JUMPS
from idbench.experiments.identification.robot_model import ASSUMED
from idbench.experiments.judgement.held_out import FAIR, GOOD, WORDS, HeldOut, Verdict, on_last_quarter, on_log
from idbench.experiments.judgement.warnings import DELAY, LOG, MODEL
from idbench.experiments.note import noted
from idbench.experiments.text import error_percentage
from idbench.identify.models import THREE


@dataclass(frozen=True)
class Unjudged:
    """A held-out log on which a fit could not be judged."""

    title: str
    """What to call it."""
    why: str
    """The reason."""
    traceback: str = ""
    """Of a fault of idbench."""

    def summary(self) -> dict[str, Any]:
        """Its part of summary.json."""
        return {"on": self.title, "models": {}, "failure": self.why}


@dataclass(frozen=True, eq=False)
class Judgement:
    """A fit, judged."""

    fit: Fit
    """The fit."""
    on: tuple[HeldOut | Unjudged, ...]
    """The fit on each held-out log."""

    @property
    def held_out(self) -> list[HeldOut]:
        """The logs on which it could be judged."""
        return [one for one in self.on if isinstance(one, HeldOut)]

    @property
    def failures(self) -> list[Unjudged]:
        """The logs on which it could not be judged though they were given for that, and faults."""
        return [one for one in self.on if isinstance(one, Unjudged) and (self.fit.logs.held_out or one.traceback)]

    @property
    def hardest(self) -> HeldOut | None:
        """The held-out log on which the leading model does worst; None if it was judged on none."""
        return max(self.held_out, key=_place, default=None)

    @property
    def verdict(self) -> Verdict | None:
        """The verdict on the leading model on the hardest held-out log; None if there is no such log."""
        return None if self.hardest is None else self.hardest.verdicts[self.hardest.fit.leading]

    @property
    def good(self) -> bool:
        """Whether the leading model is good on every held-out log."""
        return self.hardest is not None and WORDS[_place(self.hardest)] == "good"

    def short_of(self, percent: float) -> str:
        """What falls short of torque errors of this share on every held-out log; empty if nothing does."""
        if not self.held_out:
            return "it was judged on no held-out log"
        if (worst := max(_worst(one) for one in self.held_out)) > percent:
            return f"torque errors of {error_percentage(worst)} on a held-out log"
        hidden, joint = _hidden(self.fit)
        return "" if hidden <= WEAK else f"the log would not show a torque constant of {joint} that is {100 * WEAK:g} % off"

    def summary(self) -> dict[str, Any]:
        """Its part of summary.json, beside the fit's own."""
        each = [one.summary() for one in self.on]
        return {"validation": each[0], "validations": each}


def _place(one: HeldOut) -> int:
    """Return the place, in WORDS, of the verdict on the leading model, which is shown and written."""
    return WORDS.index(one.verdicts[one.fit.leading].word)


def _worst(one: HeldOut) -> float:
    """Largest torque error of a joint, by the leading model [%]."""
    return float(np.nanmax(np.nan_to_num(one.torques[one.fit.leading].percent, nan=0.0, posinf=np.inf)))


def _hidden(fit: Fit) -> tuple[float, str]:
    """Largest error of a torque constant that would not be seen, and its joint; 0 where none moves, or a log is too long."""
    gains = zip(() if fit.hidden_gains is None else fit.hidden_gains, fit.robot_model.robot.joints, strict=False)
    return max(((float(x), joint) for x, joint in gains if joint not in fit.still), default=(0.0, ""))


def judge(result: Fit) -> Judgement:
    """Return a fit, judged on each held-out log, or on the last quarter of its longest; one that fails leaves the others."""
    given = (result.logs.held_out or {}).items()
    if not given:
        title = f"the last quarter of {result.logs.longest_name}"
        return Judgement(result, (_judged(title, lambda: on_last_quarter(result)),))
    return Judgement(result, tuple(_judged(f"held-out log {name}", lambda: on_log(result, name, log)) for name, log in given))  # noqa: B023  # called at once


def _judged(title: str, make: Callable[[], HeldOut]) -> HeldOut | Unjudged:
    try:
        made = make()
        made.summary()  # torques, the simulated robot, verdicts: whoever shows them later finds them made
        return made
    except Exception as error:  # one log takes nothing away from the others
        return Unjudged(title, reason(error), "" if is_told(error) else trace(error))


WEAK = 0.1  # Error of a torque constant from which on a log that would not show it is weak


def conclusion(judgement: Judgement, warnings: Mapping[str, Sequence[str]], written: Sequence[Path] = ()) -> Conclusion:
    """The answer on the hardest held-out log, of a robot that will be `written` to files.

    Jumps of the log come before mistakes, which they cause; other doubts about it only where no mistake is proved.
    """
    verdict = judgement.verdict
    word = verdict.word if verdict else ""
    causes = judgement.fit.diagnosis or ()
    proved = any(any(cause.suspect.held_out) for cause in causes)
    certain = proved or word == "good"
    doubts = (doubt for doubt in map(noted, warnings.get(LOG, ())) if doubt.about == JUMPS or (doubt.option and not certain))
    of_log = str(next(doubts, ""))
    step = of_log or _next(judgement, warnings, written)
    if word == "poor" and judgement.fit.robot_model.assumed:
        step = f"{ASSUMED}: --robot FILE names another"
    finding, *why = _findings(judgement, [] if of_log else causes)
    return Conclusion(word, finding, step, "; ".join(why))


def _findings(judgement: Judgement, causes: Sequence[Cause]) -> list[str]:
    """The verdict in a sentence, and what limits it."""
    one, verdict = judgement.hardest, judgement.verdict
    if one is None or verdict is None:
        return ["Result: not validated"]
    model = one.fit.leading
    result = f"Result: {verdict.word}{'' if model == THREE[0] else f' ({model} model)'}:"
    if verdict.wrong:
        return [f"{result} {verdict.wrong[0].finding}"]
    worst = _worst(one)
    beyond = float(np.nanmax(np.nan_to_num(one.torques[model].percent_of_level(one.torques[model].excess), posinf=np.inf)))
    most = {"good": GOOD, "fair": FAIR}.get(verdict.word, np.inf)
    noisy = f", {error_percentage(beyond)} beyond noise and sigma," if beyond < most < worst else ""
    found = f"{result} torques within {error_percentage(worst)}{noisy} on {one.title.finding}"
    seen = list(_power(judgement.fit)) if verdict.word == "good" and not causes else []
    if len(seen) == 1:
        found, seen = f"{found}; {seen[0]}", []
    far = [] if verdict.word == "poor" or causes else WrittenRobot(judgement.fit, model).strayed
    return [found, *(cause.words for cause in causes[:1]), *seen, *far]


def _power(fit: Fit) -> Iterator[str]:
    """Yield what a good result would have seen, and of which joints nothing is known."""
    if still := fit.still:
        yield f"nothing is known of {', '.join(still)}: no motion"
    worst, joint = _hidden(fit)
    if joint:
        if not worst < 1:
            yield f"cannot see a gain error of {joint}"
        elif worst > WEAK:
            yield f"would not see a gain error of {joint} below {error_percentage(100 * worst)}"
        else:
            yield f"sees gain errors above {error_percentage(100 * worst)}"


def _next(judgement: Judgement, warnings: Mapping[str, Sequence[str]], written: Sequence[Path]) -> str:
    """Next step: what mends the first mistake, beside others; else an option that was proved; else the first doubt."""
    if causes := judgement.fit.diagnosis:
        return remedy_of(causes) if causes[0].remedy else causes[0].mends
    of_delay_and_model = (*warnings.get(DELAY, ()), *warnings.get(MODEL, ()))
    if proved := next((warning for warning in of_delay_and_model if noted(warning).option), ""):
        return proved
    if judgement.good:
        return f"use {', '.join(map(str, written))}" if written else "--write arm.urdf arm.json arm.py keeps the robot"
    if first := next((found[0] for found in warnings.values() if found), ""):
        return first
    if judgement.fit.logs.fitted[0].poses:
        return "more poses"
    asked = judgement.fit.request.robot_model.asked.friction
    law = "" if judgement.fit.choice is not None or asked != ("standard",) else ", or another law of friction (--friction auto)"
    return f"a longer or more exciting motion (idbench excite){law}"
