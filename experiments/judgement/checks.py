"""What to check of an identification, the likely cause first: log, delay, the robot's file, motion, model."""

from collections.abc import Iterator

from idbench.experiments.identification.lack import advice_on_lack
from idbench.experiments.identification.log_warnings import unusable, warnings_of_log
from idbench.experiments.judgement.judgement import Judgement
from idbench.experiments.judgement.remedies import Remedies, delay_advice
from idbench.experiments.judgement.warnings import (
    DELAY,
    FILE,
    LOG,
    MODEL,
    MOTION,
    hidden_notes,
    warnings_of_result,
    warnings_of_robot,
)


def checks(judgement: Judgement, *, delay: bool) -> dict[str, list[str]]:
    """Return warnings by what they are about.

    Parameters
    ----------
    judgement : Judgement
        The judged fit.
    delay : bool
        Whether the delay of the torques was given, so that it is compared with that which the log shows.
    """
    result = judgement.fit
    of_logs = list(warnings_of_logs(judgement))
    found: dict[str, list[str]] = {LOG: of_logs, DELAY: [], FILE: warnings_of_robot(result.robot_model.robot)}
    found |= {MOTION: [], MODEL: []}
    if any(map(unusable, result.logs.fitted)):  # all else may be its doing
        return found
    found[MOTION] += hidden_notes(result)
    for about, warnings in warnings_of_result(result).items():
        found[about] += warnings
    hardest = judgement.hardest
    if hardest is not None and not result.logs.long:
        # Friction absorbs a wrong delay, and the verdict may be good: the log itself is asked.
        found[DELAY] += delay_advice(result) if delay else ()
        found[MODEL] += () if judgement.good else Remedies(hardest).options()
    found[MODEL] += advice_on_lack(result.lack, result.robot_model.robot.joints)
    return found


def warnings_of_logs(judgement: Judgement) -> Iterator[str]:
    """Yield what is suspicious about the logs, fitted and held out."""
    logs, tree = judgement.fit.logs, judgement.fit.robot_model.tree
    several = len(logs.fitted) > 1
    every = [(f"{logs.name(k)}: " if several else "", log) for k, log in enumerate(logs.fitted)]
    every += [(f"{name}: ", log) for name, log in (logs.held_out or {}).items()]
    return (before + warning for before, log in every for warning in warnings_of_log(log, tree))
