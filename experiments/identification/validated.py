"""Torques of a motion that an identification has not seen, and the identified robot, simulated on it."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from math import ceil
from typing import Any, final

import numpy as np

from experiments.identification.consistent_robot import Written
from experiments.identification.identified import Identified
from identify import Array, Basis, ExplicitModel, IdentificationError, MotionLog, Problem, State, Validation, split, validate
from identify.arrays import combined
from identify.rows.long_logs import manageable
from sim.engine.replay import Replay, replay
from sim.errors import BenchError

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
        if self.second is not None:
            return self.found
        k, logs = self._longest, self.found.logs
        return replace(self.found, logs=(*logs[:k], split(logs[k])[0], *logs[k + 1 :]))

    @cached_property
    def unseen(self) -> MotionLog:
        """The motion on which it is judged; of a long one the beginning."""
        return manageable([split(self.found.logs[self._longest])[1] if self.second is None else self.second])[0]

    @property
    def _longest(self) -> int:
        """The number of the log of which the end is held out."""
        return max(range(len(self.found.logs)), key=lambda k: self.found.logs[k].samples)

    @property
    def title(self) -> str:
        """What it is judged on."""
        if self.name:
            return f"unseen motion {self.name}"
        names = self.found.log_names
        return f"the last quarter of {names[self._longest] if len(names) > 1 else 'the log'}, by a fit of the rest"

    @cached_property
    def torques(self) -> dict[str, Validation]:
        """How well each model predicts the torques."""
        return {model: validate(self.problem, e.X, e.best_covariance) for model, e in self.judged.estimates.items()}

    @cached_property
    def problem(self) -> Problem:
        """The unseen motion, by the robot and the chain of what is judged."""
        return self.problem_of(self.judged)

    def problem_of(self, judged: Identified) -> Problem:
        """Return the unseen motion as a problem, by the robot and the chain of another identification."""
        return Problem((self.unseen,), judged.basis, ExplicitModel(), judged.processing)

    @cached_property
    def replays(self) -> dict[str, Replay | str]:
        """What the robot with each model's parameters does with the torques of the log, or why that is not known."""
        return {model: self._replay(model) for model in self.judged.estimates}

    def _replay(self, model: str) -> Replay | str:
        try:
            written = Written(self.judged, model)
            log, qd = self._replayed
            return replay(written.robot, _without(log, qd, self.judged.basis, written.lost), qd, BANDWIDTH)
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

    def summary(self) -> dict[str, Any]:
        """Return what a summary.json says of it."""
        return {
            "on": self.title,
            "models": {model: self._of(model) for model in self.torques},
            "failures": self.judged.failures,
        }

    def _of(self, model: str) -> dict[str, Any]:
        validation, off = self.torques[model], self.position_error(model)
        numbers = {
            "torque_error_rms": validation.rms,
            "torque_error_percent": validation.percent,
            "noise_rms": validation.noise,
            "sigma_rms": validation.open,
            "unexplained_percent": validation.percent_of_level(validation.excess),
            "R2": validation.R2,
            "standing_error_rms": validation.standing,
            "residual_correlation": validation.correlation,
            "residual_correlation_bound": validation.bound,
        }
        found: dict[str, Any] = {
            name: [float(x) if np.isfinite(x) else None for x in values] for name, values in numbers.items()
        }
        return {**found, "position_error_rms": None if off is None else off.tolist()}


def _without(log: MotionLog, qd: Array, basis: Basis, lost: Mapping[str, float]) -> MotionLog:
    """Return a log without the torques of laws of friction that a simulated robot does not have."""
    if not (there := [name for name in lost if name in basis.names]):
        return log
    q, v, conditions = log.q.T, np.ascontiguousarray(qd.T), {name: x.T for name, x in log.conditions.items()}
    state = State(q, v, lambda _: np.gradient(v, 1 / log.fs, axis=-1), conditions)
    laws, X = basis.renamed({name: name for name in there}), np.array([lost[name] for name in there])
    tau = log.tau * np.asarray(log.torque.gain) - combined(laws.explicit(state), laws.names, X, np.zeros(q.shape)).T
    return replace(log, tau=tau, torque=replace(log.torque, gain=1.0))
