"""Logs of poses at rest: each row is by itself, and shows gravity."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from idbench.experiments.errors import ExperimentError
from idbench.experiments.identification.request import Request
from idbench.identify import Array, MotionLog, TorqueChannel
from idbench.identify.data.log_columns import LogColumns
from idbench.identify.rows.chain import poses_chain

POSES = "poses"  # Name of their chain
SLOWEST = 0.5  # Sampling period [s] that no log of a robot's motion has: its times are in another unit, or its rows are poses

APART = 0.6
"""Rms of the steps of a joint, over the standard deviation of its positions, from which on rows do not continue each other: of
independent poses it is the root of 2, of a sine that is sampled 20 times a period 0.4."""


NOTHING = 1e-12
"""Length of a column over the longest up to which it is rounding: of inertia, rotors and friction, which act in motion."""


def are_poses(path: Path, columns: LogColumns, *, stated: bool) -> bool:
    """True if rows are poses at rest: that is stated, or they are far apart in time and do not continue each other.

    Raises
    ------
    ExperimentError
        If they are far apart and do: times are in another unit.
    """
    t = columns.t
    step = float(np.median(np.diff(t))) if len(t) > 1 and np.isfinite(t).all() else 0.0
    if stated or step < SLOWEST:
        return stated
    if not _jump_about(columns.q):
        raise ExperimentError(
            f"{path} has a sample every {step:.4g} s, if t is in s: is it in ms, us or ns? Then add --units t=ms, t=us or "
            "t=ns; or, if each row is a pose at rest, --poses"
        )
    return True


def _jump_about(q: Array) -> bool:
    q = q[np.isfinite(q).all(axis=1)]
    if len(q) < 2:
        return True
    steps, spread = np.sqrt(np.mean(np.diff(q, axis=0) ** 2, axis=0)), np.std(q, axis=0)
    return bool((steps > APART * spread)[spread > 0].any())


def poses_of(columns: LogColumns, channel: TorqueChannel) -> tuple[MotionLog, str]:
    """Return rows as poses at rest, and a note."""
    step = float(np.median(np.diff(columns.t))) if len(columns.t) > 1 else 1.0
    plain = TorqueChannel("instantaneous", gain=channel.gain)
    motion = () if columns.qdd is None or columns.qd is None else (columns.qd, columns.qdd)
    sound = np.logical_and.reduce([np.isfinite(x).all(axis=1) for x in (columns.q, columns.tau, *motion)])
    if not sound.any():
        raise ExperimentError("no row has a value of every position and torque")
    q, tau, *states = (x[sound] for x in (columns.q, columns.tau, *motion))
    conditions = {name: x[sound] if len(x) > 1 else x for name, x in columns.conditions.items()}
    fs, state = 1 / step if step > 0 else 1.0, (states[0], states[1]) if states else None
    log = MotionLog(fs, q, tau, plain, conditions, missing=columns.missing, poses=True, motion=state)
    left_out = f"; {np.count_nonzero(~sound)} rows without a value somewhere are left out" if not sound.all() else ""
    if motion:
        return log, f"{log.samples} rows are taken as samples by themselves: times, delays and filters do not count{left_out}"
    smooth = "" if _jump_about(q) else "; they continue each other: are they of motion? Then leave --poses out"
    return log, (
        f"{log.samples} rows are taken as poses at rest: they show gravity alone, and the friction that holds a joint is part "
        f"of its error{left_out}{smooth}"
    )


def of_poses(request: Request, logs: Sequence[MotionLog], *, band: bool, sought: str | None) -> Request:
    """Return the request of logs of poses; raise ExperimentError if a chain or a delay was asked for, or some logs move."""
    if not all(log.poses for log in logs):
        raise ExperimentError(
            "some logs are of poses at rest or samples by themselves, others of motion: identify them one by one"
        )
    if not band:
        raise ExperimentError("rows by themselves have no band: leave --chain, --chain-file and --cutoff out")
    if sought:
        raise ExperimentError(f"--torque-delay {sought}: rows by themselves show no delay; leave it out")
    # At rest all models have the equations of the explicit one, or none; of samples only this one needs no derivative.
    models = ("explicit",) if len(request.models) > 1 else request.models
    if any(log.motion for log in logs) and models != ("explicit",):
        raise ExperimentError(f"--model {models[0]}: samples by themselves have no derivatives in time: use the explicit model")
    request = replace(request.with_chain(poses_chain(), POSES), models=models)
    size = np.linalg.norm(request.problem(logs).factors.R[..., :-1], axis=(0, 1))
    unseen = [name for name, x in zip(request.robot_model.basis.names, size, strict=True) if x <= NOTHING * size.max()]
    return replace(request, robot_model=request.robot_model.without(unseen)) if len(unseen) < len(size) else request
