"""What a judged identification comes to: one sentence, and the next step."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from idbench.experiments.identification.causes import Cause, remedy_of
from idbench.experiments.identification.fit import Fit
from idbench.experiments.identification.log_warnings import JUMPS, resting
from idbench.experiments.identification.robot_model import ASSUMED
from idbench.experiments.judgement.held_out import FAIR, GOOD
from idbench.experiments.judgement.judgement import Judgement
from idbench.experiments.judgement.warnings import DELAY, LOG, MODEL
from idbench.experiments.note import noted
from idbench.experiments.text import error_percentage

WEAK = 0.1  # Error of a torque constant from which on a log that would not show it is weak


@dataclass(frozen=True)
class Conclusion:
    """The answer that terminal, report, recording and Python show."""

    word: str
    """The verdict on the leading model on the hardest held-out log; empty if there is no such log."""
    finding: str
    """The verdict in one sentence."""
    step: str
    """What to do next."""

    def __str__(self) -> str:
        return f"{self.finding}; next: {self.step}"


def conclusion(judgement: Judgement, warnings: Mapping[str, Sequence[str]]) -> Conclusion:
    """The answer on the hardest held-out log.

    Jumps of the log come before mistakes, which they cause; other doubts about it only where no mistake is proved.
    """
    verdict = judgement.verdict
    word = verdict.word if verdict else ""
    causes = judgement.fit.diagnosis or ()
    proved = any(any(cause.suspect.held_out) for cause in causes)
    certain = proved or word == "good"
    doubts = (doubt for doubt in map(noted, warnings.get(LOG, ())) if doubt.about == JUMPS or (doubt.option and not certain))
    of_log = str(next(doubts, ""))
    step = of_log or _next(judgement, warnings)
    if word == "poor" and judgement.fit.robot_model.assumed:
        step = f"{ASSUMED}: --robot FILE names another"
    return Conclusion(word, _finding(judgement, [] if of_log else causes), step)


def _finding(judgement: Judgement, causes: Sequence[Cause]) -> str:
    one, verdict = judgement.hardest, judgement.verdict
    if one is None or verdict is None:
        return "Result: not validated"
    model = one.fit.leading
    if verdict.wrong:
        return f"Result: {verdict.word} ({model} model): {verdict.wrong[0].finding}"
    worst = float(np.nanmax(np.nan_to_num(one.torques[model].percent, nan=0.0, posinf=np.inf)))
    beyond = float(np.nanmax(np.nan_to_num(one.torques[model].percent_of_level(one.torques[model].excess), posinf=np.inf)))
    most = {"good": GOOD, "fair": FAIR}.get(verdict.word, np.inf)
    noisy = f", {error_percentage(beyond)} beyond noise and sigma," if beyond < most < worst else ""
    off = f"torque errors of at most {error_percentage(worst)}{noisy}"
    found = f"Result: {verdict.word} ({model} model), {off} on {one.title.finding}"
    seen = _power(judgement.fit) if verdict.word == "good" and not causes else []
    return "; ".join([found, *(cause.words for cause in causes[:1]), *seen])


def _power(fit: Fit) -> Iterator[str]:
    """Yield what a good result would have seen, and of which joints nothing is known."""
    joints = fit.robot_model.robot.joints
    if still := [joint for joint in joints if all(joint in resting(log, fit.robot_model.tree) for log in fit.logs.fitted)]:
        yield f"nothing is known of {', '.join(still)}: no motion"
    if fit.hidden_gains is not None:
        some = [(x, joint) for x, joint in zip(fit.hidden_gains, joints, strict=True) if joint not in still]
        worst, joint = max(some)
        if not worst < 1:
            yield f"it cannot see a wrong torque constant of {joint}"
        elif worst > WEAK:
            yield f"it would not see a torque constant of {joint} that is {error_percentage(100 * worst)} off"
        else:
            yield f"sees torque constants that are {error_percentage(100 * worst)} off"


def _next(judgement: Judgement, warnings: Mapping[str, Sequence[str]]) -> str:
    """Next step: what mends the first mistake, beside others; else an option that was proved; else the first doubt."""
    if causes := judgement.fit.diagnosis:
        return remedy_of(causes) if causes[0].remedy else causes[0].mends
    of_delay_and_model = (*warnings.get(DELAY, ()), *warnings.get(MODEL, ()))
    if proved := next((warning for warning in of_delay_and_model if noted(warning).option), ""):
        return proved
    if judgement.good:
        return "--write arm.urdf arm.json arm.py keeps the robot"
    if first := next((found[0] for found in warnings.values() if found), ""):
        return first
    if judgement.fit.logs.fitted[0].poses:
        return "more poses"
    asked = judgement.fit.request.robot_model.asked.friction
    law = "" if judgement.fit.choice is not None or asked != ("standard",) else ", or another law of friction (--friction auto)"
    return f"a longer or more exciting motion (idbench excite){law}"
