"""Is an identification any good? Torques of a motion it has not seen, and the identified robot, simulated on it."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from math import ceil
from typing import Any, final

import numpy as np

from experiments.doubts import wrong_sign
from experiments.identified import Identified
from experiments.written import Written
from identify import Array, Basis, IdentificationError, MotionLog, State, Validation, split, validate
from identify.long import manageable
from sim.errors import BenchError
from sim.replay import Replay, replay

GOOD, FAIR = 2.0, 10.0
"""Torque errors [% of the torque] up to which a model is called good, or fair; a choice of ours."""

STRAYS, LOST = 1.0, 5.0
"""Position errors [% of a joint's way] up to which a simulated robot is called good, or fair; a choice of ours too."""

BANDWIDTH = 5.0
"""Of the loop that holds the simulated robot to the log [rad/s]: weak, so that errors of the model show."""

LONGEST = 60.0
"""Time [s] that is simulated, from the beginning of the unseen motion."""


@final
@dataclass(frozen=True, eq=False)
class Validated:
    """An identification, judged on a motion that it has not seen.

    Parameters
    ----------
    found : Identified
        The identification, of all of its log.
    second : MotionLog, optional
        The unseen motion. Without one, the end of the log is held out: the judged parameters are those of the rest.
    name : str
        Of the second log.
    """

    found: Identified
    second: MotionLog | None = None
    name: str = ""

    @cached_property
    def judged(self) -> Identified:
        """The identification that is judged."""
        return self.found if self.second is not None else replace(self.found, logs=(split(self.found.logs[0])[0],))

    @cached_property
    def unseen(self) -> MotionLog:
        """The motion on which it is judged; of a long one the beginning."""
        return manageable(split(self.found.logs[0])[1] if self.second is None else self.second)

    @property
    def title(self) -> str:
        """What it is judged on."""
        return f"unseen motion {self.name}" if self.name else "the last quarter of the log, by a fit of the rest"

    @cached_property
    def torques(self) -> dict[str, Validation]:
        """How well each model foretells the torques."""
        basis, chain = self.judged.basis, self.judged.processing
        return {model: validate(self.unseen, basis, e.X, chain) for model, e in self.judged.estimates.items()}

    @cached_property
    def replays(self) -> dict[str, Replay | str]:
        """What the robot with each model's parameters does with the torques of the log, or why that is not known."""
        return {model: self._replay(model) for model in self.judged.estimates}

    def _replay(self, model: str) -> Replay | str:
        try:
            written = Written(self.judged, model)
            log, qd = self._replayed
            return replay(written.robot, _without(log, qd, self.judged.subject.grouping.standard, written.lost), qd, BANDWIDTH)
        except (BenchError, IdentificationError) as error:
            return str(error)

    @cached_property
    def _replayed(self) -> tuple[MotionLog, Array]:
        """What is simulated, and its velocities; without the ends, where differences are none."""
        log, chain = self.unseen.part(0, round(LONGEST * self.unseen.fs)), self.judged.processing
        edge = ceil((chain.prefilter.halo(log.fs) + chain.differentiator.halo(log.fs)) * log.fs)
        qd = np.swapaxes(chain.signals(log).state.qd, -1, -2)
        return log.part(edge, log.samples - edge), qd[edge : log.samples - edge]

    def position_error(self, model: str) -> Array | None:
        """Return the rms of logged - simulated position [rad], shape (joint,)."""
        found = self.replays[model]
        return None if isinstance(found, str) else np.sqrt(np.mean((self._replayed[0].q - found.q) ** 2, axis=0))

    def verdict(self, model: str) -> tuple[str, list[str]]:
        """Return a word, and the reasons for it."""
        told, strays = self.torques[model], self.straying(model)
        worst, strayed = float(told.percent.max()), 0.0 if strays is None else float(strays.max())
        word = "good" if worst <= GOOD and strayed <= STRAYS else "fair" if worst <= FAIR and strayed <= LOST else "poor"
        if wrong := wrong_sign(self.judged):
            return "poor", [*(reason.partition(":")[0] for reason in wrong), *self._reasons(model, told)]
        return word, [*self._reasons(model, told), *([] if word == "good" else self._worth_a_try)]

    @property
    def _worth_a_try(self) -> list[str]:
        """What may be missing in a model that is not good."""
        subject = self.found.subject
        options = [] if "offset" in subject.asked.add else ["--add offset"]
        if not all(joint.armature for joint in subject.tree.joints):
            options.append("--armature all")
        return [f"worth a try: {', '.join(options)}"] if options else []

    def straying(self, model: str) -> Array | None:
        """Return the rms of the position error as a share of the way between a joint's ends [%], shape (joint,)."""
        off, q = self.position_error(model), self._replayed[0].q
        return None if off is None else 100 * off / np.maximum(np.ptp(q, axis=0), 1e-12)

    def _reasons(self, model: str, told: Validation) -> Iterator[str]:
        joints, worst = self.found.subject.robot.joints, int(np.argmax(told.percent))
        others = ", the others by less" if len(joints) > 1 else ""
        yield f"the torque of {joints[worst]} is off by {_percent(told.percent[worst])}{others}"
        strays = self.straying(model)
        if strays is not None and strays.max() > STRAYS:
            yield f"the simulated robot strays by {_percent(strays.max())} of its way in {joints[int(np.argmax(strays))]}"
        coloured = [joint for joint, white in zip(joints, told.white, strict=True) if not white]
        if coloured and told.percent.max() > GOOD:
            yield f"what is left of {', '.join(coloured)} is no noise: friction, elasticity or a delay is not modelled"
        elif coloured:
            yield f"what is left of {', '.join(coloured)} is no noise, but small"
        else:
            yield "what is left is not to be told from noise"
        if isinstance(self.replays[model], str):
            yield f"not simulated: {self.replays[model]}"

    def summary(self) -> dict[str, Any]:
        """Return what a summary.json says of it."""
        return {"on": self.title, "models": {model: self._of(model) for model in self.torques}}

    def _of(self, model: str) -> dict[str, Any]:
        told, (word, reasons), off = self.torques[model], self.verdict(model), self.position_error(model)
        return {
            "verdict": word,
            "reasons": reasons,
            "torque_error_rms": told.rms.tolist(),
            "torque_error_percent": [float(x) if np.isfinite(x) else None for x in told.percent],
            "R2": told.R2.tolist(),
            "standing_error_rms": [float(x) if np.isfinite(x) else None for x in told.standing],
            "residual_correlation": told.correlation.tolist(),
            "residual_correlation_bound": told.bound.tolist(),
            "position_error_rms": None if off is None else off.tolist(),
        }


def _percent(share: float) -> str:
    return f"{share:.2g} %" if share < 10 else f"{share:.0f} %"


def _without(log: MotionLog, qd: Array, standard: Basis, lost: Mapping[str, float]) -> MotionLog:
    """Return a log without the torques of laws of friction that a simulated robot does not have."""
    if not lost:
        return log
    state = State(log.q.T, np.ascontiguousarray(qd.T), np.zeros_like)
    tau = log.tau * np.asarray(log.torque.gain)
    for (joint, name), column in standard.renamed({name: name for name in lost}).explicit(state).items():
        tau[:, joint] -= lost[name] * column
    return MotionLog(log.fs, log.q, tau, replace(log.torque, gain=1.0))
