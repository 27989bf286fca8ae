"""Logs identified by some models: the estimates, and what follows from them."""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Self

import numpy as np

from idbench.experiments.identification.causes import Cause, causes_of
from idbench.experiments.identification.logs import Logs, resting
from idbench.experiments.identification.rates import CONTROLLER, Rates
from idbench.experiments.identification.request import Request
from idbench.experiments.identification.robot_model import RobotModel
from idbench.experiments.identification.stated import contradicted
from idbench.experiments.results.writing import finite, summarize
from idbench.identify import Array, Basis, Chain, Estimate, IdentificationError, Problem, encoder_steps
from idbench.identify.arrays import TINY
from idbench.identify.judge.diagnosis import diagnosed, dropped_samples
from idbench.identify.judge.friction_choice import FrictionChoice
from idbench.identify.judge.motion_share import MotionShare, motion_shares, something_else
from idbench.identify.judge.suspect import Suspect
from idbench.identify.judge.torque_gains import TorqueGains
from idbench.identify.judge.torque_interval import TorqueInterval, torque_interval
from idbench.identify.rows.rows import Rows
from idbench.identify.signals.masks import slow_speed

ALIKE = 2.0  # Factor between held-out errors up to which one cause explains as much as another
NOTHING = 1e-12  # Share of a torque's squares below which its variance is rounding


@dataclass(frozen=True, eq=False)
class Fit:
    """Logs, identified."""

    request: Request
    """What was asked for, with the laws of friction that were chosen, and without parameters that the logs do not show."""
    logs: Logs
    """The logs."""
    problem: Problem
    """Logs, robot and chain, by the explicit model."""
    outcomes: dict[str, Estimate | IdentificationError]
    """The estimate of every model, or why it has none."""
    choice: FrictionChoice | None = None
    """What was compared, where laws of friction were chosen."""
    hidden: tuple[str, ...] = ()
    """Parameters that were left out because the logs do not show them."""
    silent: tuple[Suspect, ...] = ()
    """Joints whose torques never change though they move: they were not logged, and their rows are left out."""

    @property
    def robot_model(self) -> RobotModel:
        """The robot."""
        return self.request.robot_model

    @property
    def basis(self) -> Basis:
        """The robot, linear in its parameters; about the estimate, where some of them are not."""
        return self.problem.basis

    @property
    def processing(self) -> Chain:
        """The chain."""
        return self.problem.chain

    @cached_property
    def diagnosis(self) -> tuple[Cause, ...] | None:
        """What is wrong, as residuals show it; None where the rows do not allow the tests.

        All else may be the doing of samples that were dropped.
        """
        if dropped := dropped_samples(self.logs.fitted):
            return causes_of((*self.silent, dropped), self.robot_model, self.logs.fitted[0])
        try:
            suspects = diagnosed(self.problem, self.estimates[self.leading].X)
            unknown = () if suspects else tuple(something_else(self.motion_shares))
            wrong = contradicted(self.request, self.problem, self.logs.fitted) if suspects or unknown else None
        except (IdentificationError, np.linalg.LinAlgError):  # an estimate is not lost because its tests are
            return None
        # Wrong gains, and something held that is wrong by the same factor, explain the same.
        if wrong and suspects and suspects[0].gains and suspects[0].held_out[1] <= ALIKE * wrong[0].held_out[1]:
            other = ("stated", None)
            suspects = tuple(replace(each, alternatives=(*each.alternatives, other)) for each in suspects)
        elif wrong:
            suspects = (wrong[0],)
        suspects = suspects or unknown
        log, gains, stated = self.logs.fitted[0], self.logs.gains, wrong[1] if wrong else ""
        return causes_of((*self.silent, *suspects), self.robot_model, log, gains, stated)

    @property
    def still(self) -> list[str]:
        """Joints that never move, of which nothing is known."""
        found = [resting(log, self.robot_model.robot.joints) for log in self.logs.fitted]
        return [joint for joint in found[0] if all(joint in each for each in found)]

    @cached_property
    def motion_shares(self) -> list[MotionShare]:
        """What functions of the motion predict of each joint's residual; none of poses, nor where rows are not kept."""
        explicit = self.problem.explicit
        if self.problem.long or self.logs.fitted[0].poses or explicit.rows.Y.ndim > 1:
            return []
        return motion_shares(explicit, self.estimates[self.leading].X)

    @cached_property
    def hidden_gains(self) -> Array | None:
        """Errors of torque constants that these logs would not show, shape (joint,); None where rows are not kept."""
        explicit = self.problem.explicit
        return None if self.problem.long or explicit.rows.Y.ndim > 1 else TorqueGains.of(explicit).hidden

    @property
    def noise_of_rows(self) -> Array | None:
        """Rms of what nothing of the motion predicts, of poses the noise of their torques, shape (joint,) [N m]; or None."""
        if self.logs.fitted[0].poses:
            return self.estimates[self.leading].noise_levels.torque
        return np.array([each.noise for each in self.motion_shares]) if self.motion_shares else None

    @property
    def masked_speeds(self) -> Array:
        """Speed up to which each joint's mask reaches, of the fastest log, shape (joint,) [rad/s, m/s]."""
        slow = np.max([slow_speed(signals.state.qd) for signals in self.problem.explicit.signals], axis=0)
        return np.asarray(slow * np.maximum(self.request.mask_reach or 1.0, 1.0))

    @cached_property
    def truth(self) -> dict[str, float] | None:
        """The true parameters, where they are known; what the simulated robot does not have is zero."""
        known = self.logs.truth
        return None if known is None else {name: known.get(name, 0.0) for name in self.basis.names}

    @cached_property
    def rates(self) -> Rates | None:
        """Sampling and filter frequencies, in multiples of the bandwidth of the position loop; None of poses at rest."""
        if self.logs.fitted[0].poses:
            return None
        stated, source = self.request.wdyn or (None, "from the motion; give the loop's bandwidth with --wdyn")
        if stated is None and self.request.loops and (own := self.request.loops[0].wdyn):
            stated, source = own, CONTROLLER
        first = self.problem.parts[0].signals
        qd = first.state.qd[(0,) * (first.state.qd.ndim - 2)]
        leading = self.estimates[self.leading]
        chain = replace(leading.problem.own_chain, prefilter=first.prefilter)
        return Rates.of(chain, first.fs, int(np.max(leading.row_count)), stated, source, qd)

    @cached_property
    def estimates(self) -> dict[str, Estimate]:
        """The estimates, of the models that have one."""
        return {name: outcome for name, outcome in self.outcomes.items() if isinstance(outcome, Estimate)}

    @property
    def leading(self) -> str:
        """The first model that has an estimate."""
        return next(iter(self.estimates))

    @property
    def failures(self) -> dict[str, str]:
        """Why models have no estimate."""
        return {name: str(outcome) for name, outcome in self.outcomes.items() if isinstance(outcome, IdentificationError)}

    def on(self, k: int) -> Self:
        """Return the estimates as they look on one of the logs: parameters and covariance of all, rows of that one."""
        logs = self.logs
        if len(logs.fitted) == 1:
            return self
        alone = replace(logs, fitted=logs.fitted[k : k + 1], names=logs.names[k : k + 1])
        problem = Problem(alone.fitted, self.basis, self.problem.model, self.processing)
        seen: dict[str, Estimate | IdentificationError] = {
            name: replace(e, problem=problem.with_model(e.problem.model), solution=None, calibrated=e.covariance, fits={})
            for name, e in self.estimates.items()
        }
        return replace(self, logs=alone, problem=problem, outcomes=seen)

    @cached_property
    def torque_errors(self) -> dict[str, Array]:
        """Rms of measured - predicted torque of every estimate while joints move, shape (log, joint) [N m], or NaN."""
        if self.problem.long:
            return {}
        parts = self.problem.parts
        return {name: np.array([_rms_by_kind(part.rows, e.X) for part in parts]) for name, e in self.estimates.items()}

    @cached_property
    def explained(self) -> dict[str, Array]:
        """How much of each joint's torque every estimate explains, shape (joint,); NaN where there is none to explain.

        A share of its variance; of a log whose rows are not kept, of its squares.
        """
        squares = self._torque_squares
        if not self.problem.long:
            rows = self.problem.rows
            squares = squares - np.sum(rows.by_kind(rows.Y), axis=-1) ** 2 / np.maximum(rows.count, 1)
        factors, some = self.problem.factors, squares > NOTHING * np.maximum(self._torque_squares, TINY)
        share = np.divide(1.0, squares, out=np.full(len(squares), np.nan), where=some)
        return {name: 1 - factors.squares(e.X) * share for name, e in self.estimates.items()}

    @cached_property
    def left_open(self) -> dict[str, Array]:
        """Error due to noise of the torque predicted on the own log, over that torque's rms, shape (joint,), by model."""
        W = self.problem.factors.R[..., :-1]
        spread = {name: np.sum(W @ e.noise_covariance * W, axis=(-2, -1)) for name, e in self.estimates.items()}
        squares = np.maximum(self._torque_squares, TINY)
        return {name: np.sqrt(np.maximum(found, 0.0) / squares) for name, found in spread.items()}

    @cached_property
    def torque_intervals(self) -> dict[str, TorqueInterval | None]:
        """Intervals of the torques that every estimate predicts; None where rows are not kept."""
        return {name: torque_interval(e) for name, e in self.estimates.items()}

    @property
    def _torque_squares(self) -> Array:
        return np.sum(self.problem.factors.R[..., -1] ** 2, axis=-1)

    @cached_property
    def noise(self) -> dict[str, list[float | None]]:
        """Noise of the logs as the first estimate has it [N m, rad], and the encoders' steps [rad], joint by joint."""
        levels = self.estimates[self.leading].noise_levels
        steps = encoder_steps(self.logs.fitted[0].q)
        parts = {"torque": levels.torque, "position": levels.position, "encoder_step": steps}
        return {name: [finite(x) for x in part] for name, part in parts.items()}

    @property
    def delay(self) -> tuple[float, float] | None:
        """Delay of the torques, and its standard error [s], that an estimate found beside the parameters, if one did."""
        joint = [one for e in self.estimates.values() for one in e.fits.values() if one.delay is not None]
        if not joint:
            return None
        return self.logs.fitted[0].torque.delay + (joint[0].delay or 0.0), float(joint[0].covariance[-1, -1]) ** 0.5

    @property
    def left_out(self) -> dict[str, str]:
        """Why reversals, which were asked for, are left out, model by model."""
        return {model: one.left_out for model, e in self.estimates.items() for one in e.fits.values() if one.left_out}

    def summary(self) -> dict[str, Any]:
        """Its part of summary.json."""
        truth = None if self.truth is None else list(self.truth.values())
        models = {name: summarize(e, truth) for name, e in self.estimates.items()}
        for name, share in self.explained.items():
            models[name]["explained_share"] = [finite(x) for x in share]
        for name, interval in self.torque_intervals.items():
            models[name]["torque_interval"] = None if interval is None else [finite(x) for x in interval.half]
            models[name]["torque_interval_band"] = None if interval is None else interval.band
        delay, cutoff = self.delay, self.processing.cutoff
        return {
            "parameters": list(self.basis.names),
            "units": list(self.basis.units),
            "made_of": self.robot_model.grouping.groupings,
            "truth": truth,
            "robot": self.robot_model.name,
            "chain": self.request.method.chain_name,
            "estimator": self.request.method.estimator_name,
            "torque": self._channel(0),
            "reversals_left_out": self.left_out,
            "found_delay": None if delay is None else {"delay": delay[0], "sigma": delay[1]},
            "noise": self.noise,
            "diagnosis": [cause.summary() for cause in self.diagnosis or ()],
            "models": models,
            "failures": self.failures,
            "hidden_gain_errors": None if self.hidden_gains is None else [finite(x) for x in self.hidden_gains],
            "hidden": list(self.hidden),
            "mask_speed": list(self.request.mask_speed),
            "mask_reach": list(self.request.mask_reach),
            "rates": self.rates and self.rates.summary(),
            **self.robot_model.stated,
            **({"share": self.request.share} if self.request.share else {}),
            "cutoff": cutoff,
            "logs": [self._of_log(k) for k in range(len(self.logs.fitted))],
        }

    def _channel(self, k: int) -> dict[str, Any]:
        channel = self.logs.fitted[k].torque
        more = {name: x for name in ("delay_sigma", "period", "lags") if (x := getattr(channel, name))}
        return {"meaning": channel.meaning, "delay": channel.delay, "gain": channel.gain, **more}

    def _of_log(self, k: int) -> dict[str, Any]:
        """Summary of one of the logs."""
        log, name = self.logs.fitted[k], self.logs.names[k] if self.logs.names else ""
        errors = {model: [finite(x) for x in errors[k]] for model, errors in self.torque_errors.items()}
        known = {"name": name, "samples": log.samples, "fs": log.fs, "torque": self._channel(k)}
        return {**known, "torque_error_rms": errors}


def _rms_by_kind(rows: Rows, X: Array) -> Array:
    """Return the rms of the valid residuals of each joint, shape (joint,)."""
    residual, count = rows.by_kind((rows.Y - rows.predicted(X)) * rows.valid), rows.count
    return np.sqrt(np.divide(np.sum(residual**2, axis=-1), count, out=np.full(len(count), np.nan), where=count > 0))
