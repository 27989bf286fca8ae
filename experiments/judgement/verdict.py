"""Is a model any good? A word, and the reasons for it."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Self, final

import numpy as np

from idbench.experiments.identification.fit import Fit
from idbench.experiments.judgement.warnings import wrong_sign
from idbench.experiments.text import error_percentage
from idbench.identify import Array, Validation
from idbench.identify.judge.validation import MARGIN

GOOD, FAIR = 2.0, 10.0
"""Torque errors [% of the torque] beyond noise and sigma up to which a model is called good, or fair.

docs/any-arm.md has the table of right and wrong models from which these come."""

WORDS = ("good", "fair", "unsure", "poor")
"""Verdicts, the worst last."""


@final
@dataclass(frozen=True, eq=False)
class Verdict:
    """What to think of one model on a held-out log."""

    joints: tuple[str, ...]
    """Names of the joints."""
    validation: Validation
    """Its torque errors."""
    wrong: tuple[str, ...] = ()
    """Which of the fitted torques have the wrong sign, and why."""
    unsimulated: str = ""
    """Why the identified robot was not simulated; empty if it was."""

    @classmethod
    def of(cls, judged: Fit, validation: Validation, unsimulated: str = "") -> Self:
        """Return the verdict on a model of a fit."""
        return cls(judged.robot_model.robot.joints, validation, tuple(wrong_sign(judged)), unsimulated)

    @cached_property
    def word(self) -> str:
        """good, fair or poor; unsure where noise or sigma would hide a poor model."""
        if self.wrong:
            return "poor"
        beyond, hidden = (
            _worst(self.validation.percent_of_level(x)) for x in (self.validation.excess, self.validation.expected)
        )
        if beyond > FAIR:
            return "poor"
        if hidden > FAIR or not np.isfinite(self.validation.percent).any():
            return "unsure"
        return "good" if beyond <= GOOD else "fair"

    @cached_property
    def reasons(self) -> list[str]:
        """Why, the worst joint first."""
        return [*(reason.partition(":")[0] for reason in self.wrong), *self._errors(), *self._left()]

    def _errors(self) -> Iterator[str]:
        validation, joints = self.validation, self.joints
        if not np.isfinite(validation.percent).any():
            yield "no joint moves long enough for its torque to be judged"
            return
        share = validation.excess if self.word in ("fair", "poor") else validation.rms
        j = int(np.nan_to_num(validation.percent_of_level(share), posinf=np.inf).argmax())
        worst = int(np.nan_to_num(validation.percent, posinf=np.inf).argmax())
        others = ", the others by less" if len(joints) > 1 and j == worst else ""
        yield f"the torque of {joints[j]} is off by {error_percentage(validation.percent[j])}{others}; {self._expected(j)}"
        hidden = validation.percent_of_level(validation.expected)
        worst = int(np.nan_to_num(hidden).argmax())
        if self.word == "unsure":
            share_of = error_percentage(hidden[worst])
            yield f"noise and sigma make {share_of} of the torque of {joints[worst]}: which could hide a wrong model"

    def _expected(self, j: int) -> str:
        noise, sigma = (self.validation.percent_of_level(x)[j] for x in (self.validation.noise, self.validation.open))
        known = f"noise accounts for up to {error_percentage(noise)}" if np.isfinite(noise) else "the noise is not known"
        return f"{known}, sigma of the parameters {error_percentage(sigma)}"

    def _left(self) -> Iterator[str]:
        validation = self.validation
        beyond = validation.percent_of_level(validation.excess) > GOOD
        coloured = [joint for joint, white, far in zip(self.joints, validation.white, beyond, strict=True) if far and not white]
        if coloured:
            yield f"the residual of {', '.join(coloured)} is not white"
        elif self.word == "good" and (validation.rms <= MARGIN * validation.expected).all():
            yield "noise and sigma explain all of it"

    def summary(self) -> dict[str, Any]:
        """Return what a summary.json says of it."""
        apart = [f"not simulated: {self.unsimulated}"] if self.unsimulated else []
        return {"verdict": self.word, "reasons": [*self.reasons, *apart]}


def _worst(shares: Array) -> float:
    """Return the largest of some percentages; what is not known is none."""
    return float(np.max(shares, initial=0.0, where=~np.isnan(shares)))
