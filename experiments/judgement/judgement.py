"""A fit, judged on each held-out log: made once, whatever is shown of it."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from idbench.experiments.errors import is_told, reason, trace
from idbench.experiments.identification.fit import Fit
from idbench.experiments.judgement.held_out import WORDS, HeldOut, Verdict, on_last_quarter, on_log


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

    def summary(self) -> dict[str, Any]:
        """Its part of summary.json, beside the fit's own."""
        each = [one.summary() for one in self.on]
        return {"validation": each[0], "validations": each}


def _place(one: HeldOut) -> int:
    """Return the place, in WORDS, of the verdict on the leading model, which is shown and written."""
    return WORDS.index(one.verdicts[one.fit.leading].word)


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
