"""The gains of drives, from logs without and with a known payload."""

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from idbench.identify.arrays import Array
from idbench.identify.basis.loads import DriveGains
from idbench.identify.data.motion_log import MotionLog
from idbench.identify.errors import IdentificationError, SettingError
from idbench.identify.estimators.estimate import Estimate
from idbench.identify.estimators.problem import Problem
from idbench.identify.estimators.settle import settled
from idbench.identify.iterate import iterate, not_converged
from idbench.identify.loads.loaded_robot import LoadedRobot
from idbench.identify.models import ExplicitModel

ROUNDS = 20  # At most; most logs take four
SETTLED = 1e-2  # Steps below this share of sigma no longer matter
FACTOR = 1.5  # By which a gain changes at most from one round to the next
SURE = 4.0  # Standard deviations from which on a gain below zero is no chance
VAGUE = 0.1  # A gain with a sigma above this share of it is unidentifiable from the payload


@dataclass(frozen=True, eq=False)
class GainEstimate:
    """Gains of drives."""

    gains: Array
    """Torque over what was logged, in the unit of the logs' own gain, shape (joint,)."""
    sigma: Array
    """Their standard errors, shape (joint,)."""
    found: Estimate
    """Robot, what was unknown of the payload, and kg, the gains in multiples of those of the logs."""

    @property
    def shown(self) -> npt.NDArray[np.bool_]:
        """Whether the payload shows each gain, shape (joint,)."""
        return np.isfinite(self.sigma) & (self.sigma <= VAGUE * np.abs(self.gains))


def identify_drive_gains(robot: LoadedRobot) -> GainEstimate:
    """Return the gains with which currents of logs without and with a known payload are torques.

    A payload whose mass, or more, is known makes known torques: they set the scale of each joint's current. Currents count as
    noisy, each joint's by a level of its own, the motion as exact. Least squares with currents on the side of the parameters
    instead finds gains too small, the more noise they have; see `DriveGains`.
    Ratios of the gains to those with which the logs were read are iterated, ratio(k+1) = ratio(k) g, g the gains of
    tau(ratio(k)).

    Raises
    ------
    SettingError
        If nothing is known of the payload, or there is no log without it.
    IdentificationError
        If the gains do not converge, or the motion does not excite the robot.
    """
    if not robot.known:
        raise SettingError("nothing is known of the payload: the gains need its mass at least")
    if not robot.without:
        raise SettingError("there is no log without the payload: the robot's own mass cannot be distinguished from the gains")
    n, basis = robot.tree.n, robot.basis
    with_gains: Problem
    off: Array

    def step(ratio: Array) -> tuple[Array, bool]:
        nonlocal basis, with_gains, off
        logs = tuple(read_with(log, ratio) for log in robot.of_both)
        problem = settled(Problem(logs, basis, ExplicitModel(), robot.chain))
        basis = problem.basis
        start = np.concatenate([problem.factors.fit(2).X, np.ones(n)])
        with_gains = problem.with_basis((basis + DriveGains()).linearized_at(start))
        with_gains.factors.together.check()
        found = with_gains.factors.fit(2)
        gains = found.X[-n:]
        sigma = np.sqrt(np.diagonal(found.factor.inverse(np.array(True))))[-n:]
        off = np.abs(gains - 1) / sigma
        if (off < SETTLED).all():
            return ratio, True
        _require_sign(robot, gains, sigma, problem)
        return ratio * np.clip(gains, 1 / FACTOR, FACTOR), False

    ratio, converged = iterate(step, np.ones(n), ROUNDS)
    if not converged:
        which = f"the gains of {', '.join(_names(robot, off > 1))}"
        raise IdentificationError(not_converged(which, float(off.max()), ROUNDS, "move them more, with a heavier payload"))
    final = robot.estimator.fit(with_gains)
    gains = final.X[-n:] * ratio * np.broadcast_to(robot.loaded[0].torque.gain, (n,))
    relative = final.standard_errors[-n:] / final.X[-n:]
    return GainEstimate(gains, np.abs(gains) * relative, final)


def _require_sign(robot: LoadedRobot, step: Array, sigma: Array, problem: Problem) -> None:
    """Raise IdentificationError if gains are significantly negative: kg enters as 2 - 1/kg about 1 (`DriveGains`)."""
    inverse = 2 - step
    if not (wrong := inverse < -SURE * sigma).any():
        return
    fit = problem.factors.fit(2)
    friction = [
        x for p, x in zip(problem.basis.parameters, fit.X, strict=True) if p.kind == "Coulomb friction" and wrong[p.joint]
    ]
    why = (
        "do their currents have the wrong sign (positive must speed up a positive motion)? Read them with a negative --gain."
        if friction and max(friction) < 0
        else "are the logs without and with the payload exchanged, or of different signs or units?"
    )
    raise IdentificationError(
        f"the gains of {', '.join(_names(robot, wrong))} come out below zero: {why} Or does the payload, as it is known, show "
        "too little of them? Then take a heavier one, or say where its mass is (--at)"
    )


def read_with(log: MotionLog, ratio: Array) -> MotionLog:
    """Return a log with its gains in other multiples."""
    gain = tuple(np.broadcast_to(log.torque.gain, ratio.shape) * ratio)
    return replace(log, torque=replace(log.torque, gain=gain))


def _names(robot: LoadedRobot, which: npt.NDArray[np.bool_]) -> list[str]:
    return [joint.name for joint, one in zip(robot.tree.joints, which, strict=True) if one]
