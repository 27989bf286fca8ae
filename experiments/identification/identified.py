"""A log identified by some models: what every experiment prints, records and writes."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from math import isfinite
from typing import Any, Self

import numpy as np

from experiments.identification.choices import Consistency, Start
from experiments.identification.consistent_estimate import made_consistent
from experiments.identification.defaults import CHAIN, ESTIMATOR
from experiments.identification.results import summarize
from experiments.identification.simulators import RobotPlant, ScenarioLoop
from experiments.identification.subject import Subject
from identify import (
    CHAINS,
    ESTIMATORS,
    MODELS,
    AbstractEstimator,
    Array,
    Basis,
    Chain,
    Estimate,
    ExplicitModel,
    IdentificationError,
    MotionLog,
    Problem,
    Simulation,
    attempt_each,
    encoder_steps,
)
from identify.blame import blamed
from identify.estimators.settle import settled
from identify.parameters.priors import Prior
from identify.rows.rows import Rows
from identify.signals.masks import ReversalMask
from sim.scenario.scenario import Scenario


@dataclass(frozen=True, eq=False)
class Identified:
    """A log, or several of one fit, identified when it is asked for.

    Parameters
    ----------
    logs : tuple of MotionLog
        What was logged.
    subject : Subject
        The robot.
    truth : mapping of str to float, optional
        The true parameters, where they are known.
    models : tuple of str
        Names of the models.
    chain, estimator : str
        Their names.
    method : tuple of Chain and AbstractEstimator, optional
        Both with settings of their own, instead of those that have the names.
    trim : float, optional
        Time at either end of a log that makes no rows [s]; by default what the chain needs.
    name : str
        What to call it beside others of the same log; by default chain and estimator.
    log_names : tuple of str
        What to call the logs, where there are several.
    loops : tuple of Scenario
        The closed loops in which the logs were recorded, for estimators that simulate them: one for each log.
    start : {"least-squares", "file"}
        Where estimators begin that simulate or filter: at the least-squares estimate, or at the parameters of the robot's file.
    consistent : {"no", "pullback", "entropic"}
        Whether estimates are moved to where bodies can exist.
    known : mapping of str to Estimate, optional
        Estimates that were made from other logs, to be looked at on these.
    """

    logs: tuple[MotionLog, ...]
    subject: Subject = field(default_factory=Subject)
    truth: Mapping[str, float] | None = None
    models: tuple[str, ...] = ("explicit", "implicit", "power")
    chain: str = CHAIN
    estimator: str = ESTIMATOR
    method: tuple[Chain, AbstractEstimator] | None = None
    trim: float | None = None
    name: str = ""
    log_names: tuple[str, ...] = ()
    loops: tuple[Scenario, ...] = ()
    start: Start = "least-squares"
    consistent: Consistency = "no"
    known: Mapping[str, Estimate | IdentificationError] | None = None

    def __post_init__(self) -> None:
        _ = self.basis, self.processing, ESTIMATORS.create(self.estimator), [MODELS.create(name) for name in self.models]

    @property
    def basis(self) -> Basis:
        """The robot, linear in its parameters; about the estimate, where some of them are not."""
        if not self.subject.basis.adaptive or not self.logs:
            return self.subject.basis
        return self._known_basis or self.problem.basis

    @property
    def _known_basis(self) -> Basis | None:
        known = (outcome.problem.basis for outcome in (self.known or {}).values() if isinstance(outcome, Estimate))
        return next(known, None)

    @property
    def processing(self) -> Chain:
        """The chain."""
        chain = self.method[0] if self.method else CHAINS.create(self.chain)
        if (couplings := self.subject.tree.couplings) and isinstance(chain.mask, ReversalMask):
            chain = replace(chain, mask=replace(chain.mask, couplings=tuple(c.weights for c in couplings)))
        return chain if self.trim is None else replace(chain, trim=self.trim)

    @property
    def label(self) -> str:
        """What distinguishes this identification from others of the same log."""
        return self.name or f"{self.chain}-{self.estimator}"

    @property
    def solver(self) -> AbstractEstimator:
        """The estimator."""
        return self.method[1] if self.method else ESTIMATORS.create(self.estimator)

    @cached_property
    def problem(self) -> Problem:
        """Logs, robot and chain, by the explicit model."""
        basis = self._known_basis or self.subject.basis
        with blamed():
            found = Problem(self.logs, basis, ExplicitModel(), self.processing, self.simulation)
            return found if self._known_basis else settled(found)

    @property
    def simulation(self) -> Simulation:
        """How the robot is simulated, for estimators that need it; not for what was estimated from other logs."""
        if self.known is not None:
            return Simulation()
        start = None if self.start == "least-squares" else np.array(list(self.subject.truth(self.subject.robot).values()))
        needs = self.solver.needs
        loop = ScenarioLoop.of(self.subject, self.loops, self.logs) if "loop" in needs and self.loops else None
        return Simulation(loop, RobotPlant(self.subject) if "plant" in needs else None, start)

    @cached_property
    def outcomes(self) -> dict[str, Estimate | IdentificationError]:
        """The estimate of every model, or why it has none."""
        if self.known is not None:
            return dict(self.known)
        found, consistent = self.unconstrained, self.consistent
        if consistent == "no":
            return found
        return {
            name: self._moved(outcome, consistent) if isinstance(outcome, Estimate) else outcome
            for name, outcome in found.items()
        }

    @cached_property
    def unconstrained(self) -> dict[str, Estimate | IdentificationError]:
        """The estimate of every model, or why it has none, whether bodies with it can exist or not."""
        return attempt_each(self.problem, {name: MODELS.create(name) for name in self.models}, self.solver)

    def _moved(self, estimate: Estimate, prior: Prior) -> Estimate | IdentificationError:
        try:
            return made_consistent(self.subject, estimate, prior)
        except IdentificationError as error:
            return error

    def on(self, k: int) -> Self:
        """Return the identification as it looks on one of its logs: parameters and sigma of all, rows of that one."""
        if len(self.logs) == 1:
            return self
        alone = replace(self, logs=(self.logs[k],), log_names=self.log_names[k : k + 1], loops=(), known={})
        problem = alone.problem
        known = {
            name: replace(e, problem=problem.with_model(e.problem.model), honest=e.best_covariance, whiten=None, fits={})
            for name, e in self.estimates.items()
        }
        return replace(alone, known=known)

    @cached_property
    def torque_errors(self) -> dict[str, Array]:
        """Rms of measured - predicted torque of every estimate while joints move, shape (log, joint) [N m], or NaN."""
        if self.problem.long:
            return {}
        parts = self.problem.parts
        return {name: np.array([_rms_by_kind(part, e.X) for part in parts]) for name, e in self.estimates.items()}

    @cached_property
    def estimates(self) -> dict[str, Estimate]:
        """The estimates, of the models that have one; raise the first model's IdentificationError if none has."""
        found = {name: outcome for name, outcome in self.outcomes.items() if isinstance(outcome, Estimate)}
        for outcome in self.outcomes.values():
            if not found and isinstance(outcome, IdentificationError):
                raise outcome
        return found

    @property
    def failures(self) -> dict[str, str]:
        """Why models have no estimate."""
        return {name: str(outcome) for name, outcome in self.outcomes.items() if isinstance(outcome, IdentificationError)}

    @cached_property
    def explained(self) -> dict[str, Array]:
        """How much of each joint's torque every estimate explains, shape (joint,).

        A share of its variance; of a log whose rows are not kept, of its squares.
        """
        squares = self._torque_squares
        if not self.problem.long:
            rows = self.problem.rows
            squares = squares - np.sum(rows.by_kind(rows.Y), axis=-1) ** 2 / np.maximum(rows.count, 1)
        factors = self.problem.factors
        return {name: 1 - factors.squares(e.X) / np.maximum(squares, 1e-300) for name, e in self.estimates.items()}

    @cached_property
    def left_open(self) -> dict[str, Array]:
        """Sigma of the torque that every estimate predicts on its own log, over that torque's rms, shape (joint,)."""
        W = self.problem.factors.R[..., :-1]
        spread = {name: np.sum(W @ e.best_covariance * W, axis=(-2, -1)) for name, e in self.estimates.items()}
        squares = np.maximum(self._torque_squares, 1e-300)
        return {name: np.sqrt(np.maximum(found, 0.0) / squares) for name, found in spread.items()}

    @property
    def _torque_squares(self) -> Array:
        return np.sum(self.problem.factors.R[..., -1] ** 2, axis=-1)

    @cached_property
    def noise(self) -> dict[str, list[float | None]]:
        """Noise of the logs as the first estimate has it [N m, rad], and the encoders' steps [rad], joint by joint."""
        levels = next(iter(self.estimates.values())).noise_levels
        steps = encoder_steps(self.logs[0].q)
        parts = {"torque": levels.torque, "position": levels.position, "encoder_step": steps}
        return {name: [float(x) if isfinite(x) else None for x in part] for name, part in parts.items()}

    @property
    def delay(self) -> tuple[float, float] | None:
        """Delay of the torques, and its sigma [s], that an estimate found beside the parameters, if one did."""
        fits = [fit for estimate in self.estimates.values() for fit in estimate.fits.values() if fit.delay is not None]
        if not fits:
            return None
        return self.logs[0].torque.delay + (fits[0].delay or 0.0), float(fits[0].covariance[-1, -1]) ** 0.5

    def summary(self) -> dict[str, Any]:
        """Return what a summary.json says of it."""
        truth = None if self.truth is None else list(self.truth.values())
        models = {name: summarize(e, truth) for name, e in self.estimates.items()}
        for name, share in self.explained.items():
            models[name]["explained_share"] = share.tolist()
        channel, delay = self.logs[0].torque, self.delay
        base = self.subject.base
        return {
            "parameters": list(self.basis.names),
            "units": list(self.basis.units),
            "made_of": None if base is None else dict(zip(base.names, map(base.grouping, range(len(base.names))), strict=True)),
            "truth": truth,
            "robot": self.subject.name,
            "chain": self.chain,
            "estimator": self.estimator,
            "consistent": self.consistent,
            "torque": {"meaning": channel.meaning, "delay": channel.delay, "gain": channel.gain},
            "found_delay": None if delay is None else {"delay": delay[0], "sigma": delay[1]},
            "noise": self.noise,
            "models": models,
            "failures": self.failures,
            "cutoff": getattr(self.processing.operator, "cutoff", None),
            "logs": [self._of_log(k) for k in range(len(self.logs))],
        }

    def _of_log(self, k: int) -> dict[str, Any]:
        """Return what a summary.json says of one of the logs."""
        log, channel = self.logs[k], self.logs[k].torque
        errors = {name: [_finite(x) for x in errors[k]] for name, errors in self.torque_errors.items()}
        return {
            "name": self.log_names[k] if self.log_names else "",
            "samples": log.samples,
            "fs": log.fs,
            "torque": {"meaning": channel.meaning, "delay": channel.delay, "gain": channel.gain},
            "torque_error_rms": errors,
        }


def _rms_by_kind(rows: Rows, X: Array) -> Array:
    """Return the rms of the valid residuals of each joint, shape (joint,)."""
    left, valid = rows.by_kind((rows.Y - rows.predicted(X)) * rows.valid), rows.by_kind(rows.valid)
    count = valid.sum(axis=-1)
    return np.sqrt(np.divide(np.sum(left**2, axis=-1), count, out=np.full(len(count), np.nan), where=count > 0))


def _finite(x: float) -> float | None:
    return float(x) if isfinite(x) else None
