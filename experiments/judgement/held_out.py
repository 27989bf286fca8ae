"""A fit on a log that it was not fitted to: torques, the identified robot simulated, and a verdict on each model."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from math import ceil
from typing import Any, Self

import numpy as np

from idbench.experiments.identification.causes import Cause
from idbench.experiments.identification.consistent_robot import WrittenRobot
from idbench.experiments.identification.fit import Fit
from idbench.experiments.identification.fitting import fit
from idbench.experiments.judgement.warnings import wrong_sign
from idbench.experiments.note import Note
from idbench.experiments.results.writing import finite
from idbench.experiments.text import error_percentage
from idbench.identify import Array, Basis, IdentificationError, MotionLog, Problem, State, Validation, split, validate
from idbench.identify.arrays import combined
from idbench.identify.basis.block import FRICTION, NOT_NEGATIVE, Parameter
from idbench.identify.data.motion_log import never_logged
from idbench.identify.judge.validation import MARGIN
from idbench.identify.rows.rows import manageable
from idbench.sim.engine.driven import replays
from idbench.sim.errors import BenchError
from idbench.sim.robot.robot import Robot

GOOD, FAIR = 2.0, 10.0
"""Torque errors [% of the torque] beyond noise and sigma up to which a model is called good, or fair.

docs/benchmark.md has the right and wrong models from which these come."""

WORDS = ("good", "fair", "unsure", "poor")  # Verdicts, the worst last


@dataclass(frozen=True, eq=False)
class Verdict:
    """What to think of one model on a held-out log."""

    joints: tuple[str, ...]
    """Names of the joints."""
    validation: Validation
    """Its torque errors."""
    wrong: tuple[Note, ...] = ()
    """Which of the fitted torques have the wrong sign, and why."""
    causes: tuple[Cause, ...] = ()
    """Mistakes that the fit shows: its parameters may be off by more than the torques."""
    unsimulated: str = ""
    """Why the identified robot was not simulated; empty if it was."""

    @classmethod
    def of(cls, judged: Fit, validation: Validation, causes: tuple[Cause, ...] = (), unsimulated: str = "") -> Self:
        """Return the verdict on a model of a fit."""
        return cls(judged.robot_model.robot.joints, validation, tuple(wrong_sign(judged)), causes, unsimulated)

    @cached_property
    def word(self) -> str:
        """good, fair or poor; unsure where noise or sigma would hide a poor model. None is good that shows a mistake."""
        if self.wrong or any(cause.suspect.cause == "sign" for cause in self.causes):
            return "poor"
        shares = (self.validation.percent_of_level(x) for x in (self.validation.excess, self._hidden))
        beyond, hidden = (np.fmax.reduce(share, initial=0.0) for share in shares)  # without what is not known
        if beyond > FAIR:
            return "poor"
        if hidden > FAIR or not np.isfinite(self.validation.percent).any():
            return "unsure"
        return "good" if beyond <= GOOD and not self.causes else "fair"

    @property
    def _hidden(self) -> Array:
        """Error of the model that noise and sigma could hide, shape (joint,) [N m]: at most what was found."""
        return np.minimum(self.validation.expected, self.validation.rms)

    @cached_property
    def reasons(self) -> list[str]:
        """Why, the worst joint first."""
        signs = [note.finding for note in self.wrong]
        return [*signs, *self._errors(), *self._left(), *(cause.words for cause in self.causes[:1])]

    def _errors(self) -> Iterator[str]:
        validation, joints = self.validation, self.joints
        if not np.isfinite(validation.percent).any():
            yield "no joint moves long enough for its torque to be judged"
            return
        share = validation.excess if self.word in ("fair", "poor") and validation.excess.any() else validation.rms
        j = int(np.nan_to_num(validation.percent_of_level(share), posinf=np.inf).argmax())
        worst = int(np.nan_to_num(validation.percent, posinf=np.inf).argmax())
        others = ", the others by less" if len(joints) > 1 and j == worst else ""
        yield f"the torque of {joints[j]} is off by {error_percentage(validation.percent[j])}{others}; {self._expected(j)}"
        hidden = validation.percent_of_level(self._hidden)
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
        """Its part of summary.json."""
        apart = [f"not simulated: {self.unsimulated}"] if self.unsimulated else []
        return {"verdict": self.word, "reasons": [*self.reasons, *apart]}


BANDWIDTH = 5.0  # Of the loop that holds the simulated robot to the log [rad/s]: weak, so that errors of the model show

SAME = 1e-3
"""Share of a standard error up to which parameters of two models are the same: implicit differs from explicit by 1e-5."""

SHAPE = "shape of friction"  # Kind of parameters that enter nonlinearly
LONGEST = 60.0  # Time [s] that is simulated, from the beginning of the held-out log


def on_log(result: Fit, name: str, log: MotionLog) -> "HeldOut":
    """Return a fit on another log; of a long one on its beginning."""
    missing = {*log.missing, *never_logged(result.logs.fitted)}  # of what only their rows would show nothing is known
    one = replace(manageable([log])[0], missing=tuple(missing))
    return HeldOut(result, one, Note(f"held-out log {name}"), result.diagnosis or ())


def on_last_quarter(result: Fit) -> "HeldOut":
    """Return a fit of all but the last quarter of the longest log, on that quarter."""
    logs, k = result.logs, result.logs.longest
    rest, end = split(logs.fitted[k])
    fitted = (*logs.fitted[:k], rest, *logs.fitted[k + 1 :])
    laws = "" if result.choice is None else ", with the laws of friction that all of it chose"
    last = f"the last quarter of {logs.longest_name}"
    title = Note(f"{last}, by a fit of the rest{laws}", finding=last)
    return HeldOut(fit(result.request, replace(logs, fitted=fitted)), manageable([end])[0], title, result.diagnosis or ())


@dataclass(frozen=True, eq=False)
class HeldOut:
    """A fit on a log that it was not fitted to."""

    fit: Fit
    """The fit."""
    log: MotionLog
    """The log."""
    title: Note
    """What to call it, and how it was made."""
    causes: tuple[Cause, ...] = ()
    """Mistakes that the whole fit shows."""

    @cached_property
    def problem(self) -> Problem:
        """The log as a problem, by the robot and the chain of the fit."""
        return Problem((self.log,), self.fit.basis, self.fit.problem.model, self.fit.processing)

    @cached_property
    def torques(self) -> dict[str, Validation]:
        """How well each model predicts the torques."""
        noise = self.fit.noise_of_rows
        return {model: validate(self.problem, e.X, e.within_covariance, noise) for model, e in self.fit.estimates.items()}

    def within_interval(self, model: str) -> tuple[Array, float] | None:
        """Return the share of each joint's torques within the fit's intervals, and that of the log outside the fit."""
        interval = self.fit.torque_intervals[model]
        return None if interval is None else (interval.contained(self.problem, self.fit.estimates[model].X))

    @cached_property
    def replays(self) -> dict[str, Array | str]:
        """Positions [rad] of the robot with each model's parameters under the torques of the log, or why they are not known."""
        same = dict[str, str]()
        for model in self.fit.estimates:
            same[model] = next((same[other] for other in same if self._agree(model, other)), model)
        found, driven = dict[str, Array | str](), dict[str, tuple[Robot, MotionLog]]()
        for model in dict.fromkeys(same.values()):
            try:
                robot, log, qd = self.driven(model)
                driven[model] = robot, log
            except (BenchError, IdentificationError) as error:
                found[model] = str(error)
        if driven:
            robots, logs = zip(*driven.values(), strict=True)
            found |= dict(zip(driven, replays(robots, logs, qd, BANDWIDTH), strict=True))
        return {model: found[other] for model, other in same.items()}

    def _agree(self, model: str, other: str) -> bool:
        """True if the parameters of two models are the same, far within their standard errors."""
        one, two = self.fit.estimates[model], self.fit.estimates[other]
        return bool((np.abs(one.X - two.X) <= SAME * one.standard_errors).all())

    @cached_property
    def verdicts(self) -> dict[str, Verdict]:
        """What to think of each model."""
        why = {model: found for model, found in self.replays.items() if isinstance(found, str)}
        return {model: Verdict.of(self.fit, v, self.causes, why.get(model, "")) for model, v in self.torques.items()}

    @property
    def alike(self) -> dict[tuple[str, str], list[str]]:
        """The verdicts, word and reasons, with the models that have them."""
        found: dict[tuple[str, str], list[str]] = {}
        for model, verdict in self.verdicts.items():
            found.setdefault((verdict.word, "; ".join(verdict.reasons)), []).append(model)
        return found

    def driven(self, model: str) -> tuple[Robot, MotionLog, Array]:
        """Return the robot with a model's parameters, what drives it, and velocities of the log [rad/s].

        Raises
        ------
        BenchError, IdentificationError
            If there is no such robot.
        """
        written, (log, qd) = WrittenRobot(self.fit, model), self._replayed
        if log.missing:
            names = ", ".join(self.fit.robot_model.robot.joints[j] for j in log.missing)
            raise IdentificationError(f"the torque of {names} was not logged")
        if log.poses:
            raise IdentificationError("poses at rest hold no motion")
        basis, estimate = self.fit.basis, self.fit.estimates[model].X.tolist()
        standard, values = self.fit.robot_model.grouping.standard, written.lost
        lost = {p for p in basis.parameters if p.name in values}
        X = dict(zip(basis.parameters, estimate, strict=True))
        negative = {p.joint for p, x in X.items() if p.kind in FRICTION & NOT_NEGATIVE and x < 0}
        joints = {p.joint for p in lost if p.kind in FRICTION and p.joint is not None} & negative
        # Sizes of laws are those at their shapes.
        apart = {p: x for p, x in X.items() if (p in lost or (p.joint in joints and p.kind in FRICTION)) and p.kind != SHAPE}
        # Standard parameters may have no place in a simulated robot and stand in no base parameter of their own.
        grouped = {p: values[p.name] for p in standard.parameters if p.name in values.keys() - set(basis.names)}
        log = _without(_without(log, qd, basis, apart), qd, standard, grouped)
        return written.robot(joints), log, qd

    @cached_property
    def _replayed(self) -> tuple[MotionLog, Array]:
        """What is simulated, and its velocities; without the ends, where differences are none."""
        log, chain = self.log.part(0, round(LONGEST * self.log.fs)), self.fit.processing
        edge = ceil((chain.prefilter.halo(log.fs) + chain.differentiator.halo(log.fs)) * log.fs)
        qd = np.swapaxes(chain.signals(log).state.qd, -1, -2)
        return log.part(edge, log.samples - edge), qd[edge : log.samples - edge]

    def position_error(self, model: str) -> Array | None:
        """Return the rms of logged - simulated position [rad], shape (joint,)."""
        simulated = self.replays[model]
        return None if isinstance(simulated, str) else np.sqrt(np.mean((self._replayed[0].q - simulated) ** 2, axis=0))

    def summary(self) -> dict[str, Any]:
        """Its part of summary.json."""
        return {
            "on": self.title,
            "models": {model: {**self.verdicts[model].summary(), **self._of(model)} for model in self.torques},
            "failures": self.fit.failures,
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
        found: dict[str, Any] = {name: [finite(x) for x in values] for name, values in numbers.items()}
        if (within := self.within_interval(model)) is not None:
            found["within_interval"] = [finite(x) for x in within[0]]
            found["outside_fitted"] = within[1]
        return {**found, "position_error_rms": None if off is None else off.tolist()}


def _without(log: MotionLog, qd: Array, basis: Basis, laws: Mapping[Parameter, float]) -> MotionLog:
    """Return a log without the torques of what has no place in a simulated robot: some laws of friction, balancers.

    What other laws leave of viscous or Coulomb friction may be negative, which no simulated robot can have, either: it then has
    no friction at that joint.
    """
    if not laws:
        return log
    q, v = log.q.T, np.ascontiguousarray(qd.T)
    conditions = {name: x.T for name, x in log.conditions.items()}
    state = State(q, v, lambda _: np.gradient(v, 1 / log.fs, axis=-1), conditions)
    friction, X = basis.of(list(laws)), np.array(list(laws.values()))
    tau = log.tau * np.asarray(log.torque.gain) - combined(friction.explicit(state), X, np.zeros(q.shape)).T
    return replace(log, tau=tau, torque=replace(log.torque, gain=1.0))
