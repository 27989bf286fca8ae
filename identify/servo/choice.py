"""Which law of friction a log needs: the simplest that no other predicts significantly better."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import scipy

from idbench.identify.arrays import Array
from idbench.identify.servo.fit import CLUSTERS, ServoFit
from idbench.identify.servo.left_out import cross_validate, stretches
from idbench.identify.servo.parameters import SERVO_FRICTIONS, parameters_of
from idbench.identify.servo.run import ServoRun
from idbench.identify.servo.stages import Stages

MIN_SHARE = 0.01  # Share of the samples from which on what a joint is doing is judged
SLOW = 0.05  # Speed below which a joint rests, as a share of the speed that it exceeds in 1 % of the samples


class ServoLack(NamedTuple):
    """Residuals in one kind of motion."""

    when: str
    """What the joint is doing."""
    share: float
    """Of the samples."""
    error: float
    """Mean absolute residual [rad]."""


def residuals_by_state(fit: ServoFit) -> list[ServoLack]:
    """Residuals by what the joint is doing, the largest first."""
    loop = fit.loop
    speed = loop.stacked([np.abs(np.gradient(run.clean, run.t)) for run in loop.runs])
    on = loop.stacked([run.enabled.astype(float) for run in loop.runs]) > 0.5
    # Of the command, not of its target: what matters is whether the joint is near it.
    duty = loop.stacked([run.servo.slope * np.abs(run.command - run.clean) / run.servo.limit for run in loop.runs])
    moving, full = speed > SLOW * fit.excitation.speed, duty > 1
    r = np.abs(fit.found.residual)
    kinds = {
        "torque is off": ~on,
        "the joint rests": on & ~moving,
        "the duty is at its limit, or the target on its way": on & moving & full,
        "the joint follows": on & moving & ~full,
    }
    found = [(when, some & loop.kept) for when, some in kinds.items()]
    total = loop.kept.sum()
    lacks = [ServoLack(when, float(some.sum() / total), float(r[some].mean())) for when, some in found if some.any()]
    return sorted((x for x in lacks if x.share >= MIN_SHARE), key=lambda x: -x.error)


LEVEL = 0.05  # p value, of all comparisons together, below which a law is better


@dataclass(frozen=True, eq=False)
class ServoFrictionChoice:
    """Laws of friction compared."""

    fits: dict[str, ServoFit]
    """By the law."""
    chosen: str
    """The law to use."""
    errors: dict[str, float]
    """Root mean square of the residuals of parts of the log that were left out, large ones counting less [rad]."""
    p: dict[str, float]
    """P value of each law against the simplest, two-sided, times the number of tests."""

    @property
    def fit(self) -> ServoFit:
        """That of the chosen law."""
        return self.fits[self.chosen]


def choose_friction(
    runs: Sequence[ServoRun], more: Sequence[str] = (), held: dict[str, float] | None = None
) -> ServoFrictionChoice:
    """Laws of friction compared, each by parts of the log that its fit did not see (see `cross_validate`).

    Laws are taken from the simplest on; a further one replaces the one before if it predicts the parts better and Wilcoxon's
    signed-rank test over them says that this is no chance, at a level of 5 % over all tests (Bonferroni).

    Raises
    ------
    IdentificationError
        As for `identify_servo`.
    """
    of_laws = {name for names in SERVO_FRICTIONS.values() for name in names}
    parameters_of("coulomb", (*more, *(name for name in held or {} if name not in of_laws)))
    stages = Stages.start(runs, more, held or {})
    fits = {law: stages.fit(law, more) for law in SERVO_FRICTIONS}
    c = 3 * float(np.median([fit.scale for fit in fits.values()]))  # one measure for all
    clusters = CLUSTERS * max(len(fit.free) for fit in fits.values())
    parts = min(stretches(fit.found, fit.loop, clusters) for fit in fits.values())  # the same parts of the log for all laws
    costs = {law: cross_validate(fit.found, fit.loop, c, parts).costs for law, fit in fits.items()}
    first, *others = fits
    chosen, p = first, dict[str, float]()
    for law in others:
        p[law] = p_value(costs[law], costs[first], len(others))
        if costs[law].mean() < costs[chosen].mean() and p_value(costs[law], costs[chosen], len(others)) < LEVEL:
            chosen = law
    return ServoFrictionChoice(fits, chosen, {law: float(np.sqrt(x.mean())) for law, x in costs.items()}, p)


def p_value(one: Array, other: Array, tests: int) -> float:
    """P value of Wilcoxon's signed-rank test of paired costs, times the number of tests (Bonferroni)."""
    return min(1.0, tests * float(scipy.stats.wilcoxon(one, other).pvalue))
