"""What is known of a payload, as options say it."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Self

import numpy as np

from idbench.experiments.errors import ExperimentError
from idbench.experiments.identification.causes import Cause, causes_of
from idbench.experiments.identification.fitting import fit
from idbench.experiments.identification.log_warnings import unchanging, unlike_file, warnings_of_log
from idbench.experiments.identification.logs import Logs
from idbench.experiments.identification.request import Request
from idbench.experiments.judgement.held_out import GOOD, WORDS, Verdict
from idbench.experiments.judgement.warnings import LOG, MODEL, wrong_sign
from idbench.experiments.text import error_percentage
from idbench.identify import Array, Estimate, ExplicitModel, IdentificationError, MotionLog, Problem, validate
from idbench.identify.judge.diagnosis import diagnosed
from idbench.identify.loads.drive_gains import read_with
from idbench.identify.loads.loaded_robot import LETTERS, LoadedRobot, of_payload
from idbench.identify.loads.payload import PayloadEstimate, with_robot_held

HEAVIEST = 1e5  # Mass beyond which no gripper holds anything [kg]
FARTHEST = 1e3  # Distance beyond which no gripper holds anything [m]
ROUNDING = 1e-9  # Share of the moments of inertia that is rounding of a drawing


def payload_parameters(mass: float | None, at: Sequence[float] | None, inertia: Sequence[float] | None) -> dict[str, float]:
    """Return the parameters of a payload that follow from its mass, centre of mass and inertia about that.

    ExperimentError if a value is not finite, the mass is not above 0, or something is given without what it needs.
    """
    for name, needs, given in (("--at", "--mass", at), ("--inertia", "--at", inertia)):
        if given is not None and (mass is None or (name == "--inertia" and at is None)):
            raise ExperimentError(f"{name} needs {needs}: moments are of a mass that is known")
    if mass is not None and not 0 < mass <= HEAVIEST:
        raise ExperimentError(f"--mass {mass:g} must be above 0 and at most {HEAVIEST:g} kg")
    if wrong := [x for x in at or () if not abs(x) <= FARTHEST]:
        raise ExperimentError(
            f"--at {wrong[0]:g}: the centre of mass must lie within {FARTHEST:g} m of the frame of the last link"
        )
    if inertia is not None:
        xx, yy, zz, xy, xz, yz = inertia
        about = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        moments = np.linalg.eigvalsh(about) if np.isfinite(about).all() else np.array([np.nan])
        if not (
            moments[0] >= 0 and 2 * moments[-1] <= moments.sum() * (1 + ROUNDING) and moments[-1] <= HEAVIEST * FARTHEST**2
        ):
            raise ExperimentError(
                f"--inertia {' '.join(f'{x:g}' for x in inertia)} is of no body: its principal moments must be 0 or above, "
                "and none larger than the sum of the others"
            )
    found = {} if mass is None else {"ML": float(mass)}
    if mass is not None and at is not None:
        found |= {f"M{x}L": mass * c for x, c in zip("XYZ", at, strict=True)}
        if inertia is not None:
            c = np.array(at)
            about = about + mass * (c @ c * np.eye(3) - np.outer(c, c))
            found |= dict(zip(LETTERS[:6], map(float, about[np.triu_indices(3)]), strict=True))
    return found


SURE = 4.0  # Standard errors from which on a contradiction is reported
SHARE = 0.01  # Share of a value below which what contradicts it does not matter
PAYLOAD = "the payload"  # What some warnings are about

OPTIONS = {"ML": "--mass", "MXL": "--at", "MYL": "--at", "MZL": "--at"}
"""Options that state parameters of a payload; those of its inertia by --inertia."""


@dataclass(frozen=True, eq=False)
class LoadJudgement:
    """Logs without and with a payload, judged by one estimate of robot and payload."""

    robot: LoadedRobot
    """The robot and its logs."""
    request: Request
    """How one of the logs is identified by itself."""
    names: tuple[str, ...]
    """Names of the logs, those without the payload first."""
    gain: Array
    """Torque over what the files have: the logs have been read with it, shape (joint,)."""
    gains_command: str = ""
    """The command that identifies the torque constants from these logs, if the payload's mass is known."""
    before: Mapping[str, float] | None = None
    """Base parameters of the robot that were identified before, where there are no logs without the payload."""

    def with_gains(self, ratio: Array) -> Self:
        """Return the same of logs that are read with other multiples of their gains."""
        without, loaded = (tuple(read_with(log, ratio) for log in logs) for logs in (self.robot.without, self.robot.loaded))
        return replace(self, robot=replace(self.robot, without=without, loaded=loaded), gain=self.gain * ratio)

    @cached_property
    def estimate(self) -> Estimate:
        """Robot and payload, by all logs."""
        if self.before is not None:
            return with_robot_held(self.robot, self.before)
        return self.robot.estimated(self.robot.of_both, self.robot.basis)

    @cached_property
    def causes(self) -> tuple[Cause, ...]:
        """Mistakes that all logs together show; none where the rows do not allow the tests."""
        found, robot_model = self.estimate, self.request.robot_model
        try:
            suspects = diagnosed(found.problem, found.X)
        except (IdentificationError, np.linalg.LinAlgError):
            return ()
        log = found.problem.logs[0]  # whose gain is in that of its file
        return causes_of(suspects, robot_model, log, (self.gain / np.asarray(log.torque.gain)).tolist())

    @cached_property
    def verdicts(self) -> dict[str, Verdict]:
        """How well the estimate of all logs predicts the torques of each."""
        found, joints = self.estimate, self.request.robot_model.robot.joints
        each = [Problem((log,), found.problem.basis, ExplicitModel(), self.robot.chain) for log in found.problem.logs]
        of_logs = zip(self.names, (validate(problem, found.X, found.covariance) for problem in each), strict=True)
        return {name: Verdict(joints, validation, causes=self.causes) for name, validation in of_logs}

    def word(self, doubts: Mapping[str, Sequence[str]]) -> str:
        """Return the verdict on the worst log; poor, if what was found cannot be, or contradicts what is stated."""
        return "poor" if doubts[PAYLOAD] else max((verdict.word for verdict in self.verdicts.values()), key=WORDS.index)

    def warnings(self, payload: PayloadEstimate | None) -> dict[str, list[str]]:
        """Warnings by subject."""
        of_payload_ = [*self._of_stated(), *(_of_body(payload, self.names[len(self.robot.without) :]) if payload else ())]
        logs = zip(self.names, (*self.robot.without, *self.robot.loaded), strict=True)
        of_logs = [f"{name}: {doubt}" for name, log in logs for doubt in self._of_log(log)]
        return {LOG: of_logs, PAYLOAD: of_payload_, MODEL: list(self._of_fit())}

    def _of_log(self, log: MotionLog) -> list[str]:
        """What is suspicious about a log by itself, by the robot alone: its last link includes the payload."""
        tree = self.request.robot_model.tree
        found = [*warnings_of_log(log, tree), *unchanging(log, tree)]
        try:
            alone = fit(replace(self.request, models=("explicit",)), Logs((log,)))
        except IdentificationError:  # too short for a fit of its own
            return found
        return [*found, *wrong_sign(alone), *unlike_file(alone)]

    def _of_fit(self) -> Iterator[str]:
        """Yield mistakes that the logs show, and which of them the estimate of all does not explain."""
        yield from (cause.advice for cause in self.causes)
        for name, verdict in self.verdicts.items():
            v = verdict.validation
            beyond = np.nan_to_num(v.percent_of_level(v.excess), posinf=np.inf)
            if beyond.max(initial=0.0) > GOOD:
                j = int(beyond.argmax())
                off, noise = (error_percentage(x[j]) for x in (v.percent, v.percent_of_level(v.noise)))
                yield (
                    f"{name}: the torque of {verdict.joints[j]} is off by {off} by the estimate of all logs, where its noise "
                    f"makes {noise}. Check in this order: the gains (`idbench gains`), the payload in each log, units"
                )

    def _of_stated(self) -> Iterator[str]:
        """Yield by how many standard errors what is stated of the payload contradicts the logs."""
        if not self.robot.known or not self.robot.without:
            return
        free = replace(self.robot, known={})
        names = [name for name in free.names if name in self.robot.known]
        try:
            X, C = of_payload(free.estimated(free.of_both, free.basis), names)
        except IdentificationError:  # the logs do not show it
            return
        for name, x, sigma in zip(names, X, np.sqrt(np.diagonal(C)), strict=True):
            off = abs(self.robot.known[name] - x)
            if off > max(SURE * sigma, SHARE * abs(x)):
                yield (
                    f"{OPTIONS.get(name, '--inertia')}: {name} = {self.robot.known[name]:.4g} is stated, the logs show {x:.5g} "
                    f"(sigma {sigma:.2g}), {off / sigma:.2g} sigma away: leave it out, or correct it; or are the torque "
                    f"constants off? Then {self.gains_command}"
                )


def negative_mass(payload: PayloadEstimate) -> bool:
    """True if the estimated mass is significantly below zero."""
    return any(name == "ML" and x < -SURE * s for name, x, s in zip(payload.names, payload.X, payload.sigma, strict=True))


def _of_body(payload: PayloadEstimate, loaded: tuple[str, ...]) -> Iterator[str]:
    """Yield whether no physical body has the parameters of a payload."""
    if negative_mass(payload):
        i = payload.names.index("ML")
        yield (
            f"the mass is {payload.X[i]:.4g} kg (sigma {payload.sigma[i]:.2g}), below zero: are the logs with the payload "
            f"({', '.join(loaded)}) and without it exchanged, or do torques have the wrong sign?"
        )
    elif payload.complete and payload.names:
        place = [LETTERS.index(name) for name in payload.names]
        d = (payload.consistent() - payload.standard())[place]
        far = float(np.sqrt(d @ np.linalg.solve(payload.covariance, d)))
        if far > SURE + np.sqrt(len(place)):
            yield f"the nearest physically consistent payload is {far:.2g} sigma from the estimate: its model does not hold"
