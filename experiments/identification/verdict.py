"""Is an identification any good? A word, the reasons for it, and what is most likely to mend it."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, final

import numpy as np

from experiments.errors import ExperimentError
from experiments.identification.friction_choice import with_suitable_friction
from experiments.identification.identified import Identified
from experiments.identification.subject import Subject
from experiments.identification.validated import Validated
from experiments.identification.warnings import wrong_sign
from identify import Array, IdentificationError, RangeError, Validation, WeightedLeastSquares, estimate, validate
from identify.judge.delay import estimate_delay
from identify.judge.validation import MARGIN
from sim.errors import BenchError

GOOD, FAIR = 2.0, 10.0
"""Torque errors [% of the torque] beyond noise and sigma up to which a model is called good, or fair.

docs/any-arm.md has the table of right and wrong models from which these come."""

NEGLIGIBLE = 2e-3
"""Share of a sampling period by which a delay may be off without a word: a hundredth of the SCARA's Fv1 at 100 Hz."""

SURE = 4.0
"""A delay that differs from the stated one by more than so many sigma is reported."""

WORTH, TOLERABLE = 0.7, 20.0
"""Options are recommended if they bring the error below this share of what it was, and below so many per cent."""

AUTO = "--friction auto"

DRASTIC = 1 / 3
"""Below this share of what it was they are recommended whatever is left."""


@final
@dataclass(frozen=True, eq=False)
class Verdict:
    """What to think of one model of a validated identification.

    Parameters
    ----------
    validated : Validated
        The identification and its validation.
    model : str
        Name of the model.
    """

    validated: Validated
    model: str

    @property
    def validation(self) -> Validation:
        """Its errors."""
        return self.validated.torques[self.model]

    @cached_property
    def word(self) -> str:
        """good, fair or poor; unsure where noise or sigma would hide a poor model."""
        if wrong_sign(self.validated.judged):
            return "poor"
        beyond, hidden = (
            _worst(self.validation.percent_of_level(x)) for x in (self.validation.excess, self.validation.expected)
        )
        if beyond > FAIR:
            return "poor"
        if hidden > FAIR:
            return "unsure"
        return "good" if beyond <= GOOD else "fair"

    @property
    def unsimulated(self) -> str:
        """Why the identified robot was not simulated; empty if it was."""
        replayed = self.validated.replays[self.model]
        return replayed if isinstance(replayed, str) else ""

    @property
    def reasons(self) -> list[str]:
        """Why, the worst joint first."""
        wrong = [reason.partition(":")[0] for reason in wrong_sign(self.validated.judged)]
        return [*wrong, *self._errors(), *self._left()]

    def _errors(self) -> Iterator[str]:
        validation, joints = self.validation, self.validated.found.subject.robot.joints
        share = validation.excess if self.word in ("fair", "poor") else validation.rms
        j = int(np.nan_to_num(validation.percent_of_level(share), posinf=np.inf).argmax())
        worst = int(np.nan_to_num(validation.percent, posinf=np.inf).argmax())
        others = ", the others by less" if len(joints) > 1 and j == worst else ""
        yield f"the torque of {joints[j]} is off by {percent(validation.percent[j])}{others}; {self._expected(j)}"
        hidden = validation.percent_of_level(validation.expected)
        worst = int(np.nan_to_num(hidden).argmax())
        if self.word == "unsure":
            yield f"noise and sigma make {percent(hidden[worst])} of the torque of {joints[worst]}: a wrong model could hide"

    def _expected(self, j: int) -> str:
        noise, sigma = (self.validation.percent_of_level(x)[j] for x in (self.validation.noise, self.validation.open))
        known = f"noise of this log makes {percent(noise)}" if np.isfinite(noise) else "the noise of this log is not known"
        return f"{known}, sigma of the parameters {percent(sigma)}"

    def _left(self) -> Iterator[str]:
        validation, joints = self.validation, self.validated.found.subject.robot.joints
        beyond = validation.percent_of_level(validation.excess) > GOOD
        coloured = [joint for joint, white, far in zip(joints, validation.white, beyond, strict=True) if far and not white]
        if coloured:
            yield f"what is left of {', '.join(coloured)} is no noise"
        elif self.word == "good" and (validation.rms <= MARGIN * validation.expected).all():
            yield "noise and sigma explain all of it"

    def summary(self) -> dict[str, Any]:
        """Return what a summary.json says of it."""
        apart = [f"not simulated: {self.unsimulated}"] if self.unsimulated else []
        return {"verdict": self.word, "reasons": [*self.reasons, *apart]}


@final
@dataclass(frozen=True, eq=False)
class Remedies:
    """What is most likely to mend an identification that is not good, tried out: the likely cause first.

    Parameters
    ----------
    validated : Validated
        The identification and its validation.
    """

    validated: Validated

    def delay(self) -> Iterator[str]:
        """Yield the torque delay that the log itself says, where it is another than the one that is taken."""
        found, stated = self.validated.found, self.validated.found.logs[0].torque.delay
        if wrong_sign(found):
            return
        try:
            measured = estimate_delay(list(found.logs), found.basis, found.processing)
        except RangeError as error:
            yield f"the delay of the torque is far from what is taken, or it is none of this motion: {error}"
            return
        except IdentificationError:
            return
        if abs(measured.delay - stated) > max(SURE * measured.sigma, NEGLIGIBLE / found.logs[0].fs):
            yield (
                f"the log says a torque delay of {1e3 * measured.delay:.3g} ms (sigma {1e3 * measured.sigma:.1g}), where "
                f"{1e3 * stated:.3g} ms is taken: --torque-delay estimate"
            )

    def options(self) -> Iterator[str]:
        """Yield options with which the error falls, and how far."""
        before = least = self._worst(self.validated.judged)
        for option, make in self._others().items():
            if option == AUTO and least < TOLERABLE:  # what is well enough is not worth the time
                continue
            try:
                after = self._worst(replace(self.validated.judged, subject=make(), truth=None))
            except (IdentificationError, ExperimentError, BenchError):
                continue
            if option == AUTO and after > WORTH * least:  # it finds what the others say, too
                continue
            least = min(least, after)
            if after < min(WORTH * before, TOLERABLE) or after < DRASTIC * before:
                yield f"with {option} the worst joint's error falls from {percent(before)} to {percent(after)}"

    def _others(self) -> dict[str, Callable[[], Subject]]:
        """Return the options, and what makes the robot that each describes."""
        subject, found = self.validated.found.subject, dict[str, Callable[[], Subject]]()
        asked, mounting, joints = subject.asked, subject.mounting, subject.robot.joints
        if not all(joint.armature for joint in subject.tree.joints):
            found["--armature all"] = lambda: replace(subject, asked=replace(asked, armature="all"))
        if "offset" not in asked.add:
            found["--add offset"] = lambda: replace(subject, asked=replace(asked, add=(*asked.add, "offset")))
        if len(joints) > 1 and not subject.tree.couplings:
            drive = f"motor{len(joints)}", ((joints[-2], 1.0), (joints[-1], 1.0))
            option = f"--coupling {drive[0]}={joints[-2]}+{joints[-1]}"
            found[option] = lambda: replace(subject, mounting=replace(mounting, couplings=(drive,)))
        if subject.laws.standard and asked.friction == ("standard",):
            found[AUTO] = lambda: with_suitable_friction(self.validated.judged, most=1)[0].subject
        return found

    def _worst(self, judged: Identified) -> float:
        """Return the largest error [%] of the explicit model on the unseen motion."""
        simulates = bool({"loop", "plant"} & judged.solver.needs)  # far too long to try things with
        X = estimate(judged.problem, WeightedLeastSquares() if simulates else judged.solver).X
        return float(np.nanmax(validate(self.validated.problem_of(judged), X).percent))


def percent(share: float) -> str:
    """Return a percentage to two digits, or to none from ten on; beyond a thousand it says no more."""
    return f"{share:.2g} %" if share < 10 else f"{share:.0f} %" if share < 1000 else "more than 1000 %"


def _worst(shares: Array) -> float:
    """Return the largest of some percentages; what is not known is none."""
    return float(np.max(shares, initial=0.0, where=~np.isnan(shares)))
