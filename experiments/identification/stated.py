"""What was stated of parameters, asked of the log: held, tied or roughly known ones that it contradicts."""

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from idbench.experiments.errors import ExperimentError
from idbench.experiments.identification.request import Request
from idbench.experiments.requests.shared import Parameters
from idbench.identify import IdentificationError, MotionLog, Problem
from idbench.identify.judge.stretches import held_out_errors, left_unexplained, noise_errors
from idbench.identify.judge.suspect import Suspect
from idbench.identify.judge.whole_mistakes import NOTHING_LEFT


def contradicted(request: Request, problem: Problem, logs: tuple[MotionLog, ...]) -> tuple[Suspect, str] | None:
    """The statement without which held-out stretches are explained, and its option; None if nothing stated is wrong.

    Parameters
    ----------
    request : Request
        What was asked for.
    problem : Problem
        Its logs, as they were fitted.
    logs : tuple of MotionLog
        The logs.
    """
    before, noise = held_out_errors(problem), noise_errors(problem)
    for option, asked in _fewer(request.robot_model.asked):
        try:
            without = replace(request, robot_model=replace(request.robot_model, asked=asked), share=None)
            errors = held_out_errors(without.problem(logs))
        except (ExperimentError, IdentificationError, np.linalg.LinAlgError):
            continue  # such as of a log that does not show everything
        j = int(np.argmax(np.log(before) - np.log(errors)))
        if left_unexplained(before, errors, noise)[j] <= NOTHING_LEFT:
            pair = (float(before[j]), float(errors[j]))
            return Suspect("stated", "request", None, (1.0,), (0.0,), "1", 0.0, np.inf, (), pair, 0.0), option
    return None


def _fewer(asked: Parameters) -> Iterator[tuple[str, Parameters]]:
    """Yield options that state parameters, word by word and then whole, with what is asked for without them."""
    for option, words in (("hold", asked.hold), ("tie", asked.tie), ("prior", asked.prior)):
        fewer = {word: tuple(each for each in words if each != word) for word in words}
        for word, left in (fewer | ({" ".join(words): ()} if len(words) > 1 else {})).items():
            changed: dict[str, Any] = {option: left}
            yield f"--{option} {word}", replace(asked, **changed)
