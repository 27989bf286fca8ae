"""What a fit of a servo lacks: how large its residuals are, by what the joint is doing."""

from typing import NamedTuple, final

import numpy as np

from idbench.identify.arrays import Array
from idbench.identify.servo.fit import ServoFit

MIN_SHARE = 0.01
"""Share of the samples from which on what a joint is doing is judged."""

SLOW = 0.05
"""Speed below which a joint rests, as a share of the speed that it exceeds in 1 % of the samples."""


@final
class Lack(NamedTuple):
    """Residuals in one kind of motion."""

    when: str
    """What the joint is doing."""
    share: float
    """Of the samples."""
    error: float
    """Mean absolute residual [rad]."""


def lacks_of(fit: ServoFit) -> list[Lack]:
    """Return residuals by what the joint is doing, the largest first."""
    loop, servo = fit.loop, fit.servo
    speed = np.stack([_spread(np.abs(np.gradient(run.clean, run.t)), loop.samples) for run in loop.runs])
    on = np.stack([_spread(run.enabled.astype(float), loop.samples) > 0.5 for run in loop.runs])
    duty = np.stack(
        [_spread(servo.gain * run.kp * np.abs(run.command - run.clean), loop.samples) for run in loop.runs]
    )  # of the command, not of its target: what matters is whether the joint is near it
    moving, full = speed > SLOW * fit.excitation.speed, duty > servo.duty_limit
    r = np.abs(fit.found.residual)
    kinds = {
        "torque is off": ~on,
        "the joint rests": on & ~moving,
        "the duty is at its limit, or the target on its way": on & moving & full,
        "the joint follows": on & moving & ~full,
    }
    found = [(when, some & loop.kept) for when, some in kinds.items()]
    total = loop.kept.sum()
    lacks = [Lack(when, float(some.sum() / total), float(r[some].mean())) for when, some in found if some.any()]
    return sorted((x for x in lacks if x.share >= MIN_SHARE), key=lambda x: -x.error)


def _spread(x: Array, length: int) -> Array:
    return np.concatenate([x, np.full(length - len(x), x[-1])])
