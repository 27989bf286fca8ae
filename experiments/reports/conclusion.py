"""The last line of an identification: is it good, on what, and what to do next."""

from collections.abc import Mapping, Sequence

import numpy as np

from idbench.experiments.identification.held_out import HeldOut
from idbench.experiments.identification.judgement import Judgement
from idbench.experiments.reports.leading import leading
from idbench.experiments.text import error_percentage


def conclusion(judgement: Judgement, warnings: Mapping[str, Sequence[str]]) -> str:
    """Return one sentence on the hardest held-out log, and the next step."""
    first = next((about for about, found in warnings.items() if found), "")
    return f"{_found(judgement.hardest)}; {_next(judgement, first)}"


def _found(one: HeldOut | None) -> str:
    if one is None:
        return "Result: not validated"
    model = leading({name: validation.rms for name, validation in one.torques.items()})
    worst = float(np.nanmax(np.nan_to_num(one.torques[model].percent, nan=0.0, posinf=np.inf)))
    word, wrong = one.verdicts[model].word, one.verdicts[model].wrong
    if wrong:
        return f"Result: {word} ({model} model): {wrong[0].partition(':')[0]}"
    return f"Result: {word} ({model} model), torque errors of at most {error_percentage(worst)} on {_short(one.title)}"


def _short(title: str) -> str:
    """Return what a held-out log is called, without how it was made."""
    return title.partition(", by a fit of the rest")[0]


def _next(judgement: Judgement, first: str) -> str:
    if first:
        return f"next: check {first}"
    if judgement.good:
        return "next: --write arm.urdf arm.json arm.py keeps the robot"
    return "next: a longer or more exciting motion (idbench excite), or another law of friction (--friction auto)"
