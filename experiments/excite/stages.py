"""The stages of a search: soft and smooth limits first, then those that are."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from idbench.experiments.excite.design import SIGMA, Design
from idbench.experiments.excite.limit_use import LimitUse
from idbench.identify import Array
from idbench.identify.data.kinematics import Limits
from idbench.identify.design.plan import POWER, Plan
from idbench.identify.design.search import DesignSearch

STARTS, BASINS = 5, 12  # Least starts of the search, and starts times joints: few joints take little time


class Stage(NamedTuple):
    """Steps under the same conditions: limits that are hard from the first lead to poor motions, or nowhere."""

    power: float
    """Of the norm that scales motions into their limits."""
    hard: float
    """What exceeding limits costs."""
    keep: int | None
    """How many of the best are followed; None for all."""
    steps: int
    """From each."""


STAGES = Stage(24.0, 0.1, None, 50), Stage(24.0, 0.3, 3, 80), Stage(POWER, 10.0, 1, 80)
"""The first asks for the determinant, the others for what is minimised."""

HARDER = 100.0, 1000.0, 10000.0, 100000.0
"""What exceeding limits costs while some are still broken; they also become narrower, by as much as is exceeded: between the
states that the search looks at torques may be larger, where a joint reverses."""

FARTHEST = 1.5
"""Most by which limits become narrower at once: a motion that leads far beyond them says little of how near it may go."""

CLOSER = 1.005  # Factor by which limits become narrower than what they are exceeded by


def searched(design: Design, random: Sequence[Array], progress: Callable[[float], None] | None = None) -> DesignSearch:
    """Return the search of the best motion, begun with the best of random ones and those of the kind's own."""
    rng, starts = np.random.default_rng([design.seed, 2]), max(STARTS, BASINS // design.robot_model.robot.n)
    own = design.excitation.starts(rng, design.plan, design.duration, design.frequency, starts - bool(random))
    cheapest = sorted(random, key=lambda c: design.plan.value(c)[0])[:1]
    total = sum((stage.keep or starts) * stage.steps for stage in STAGES)
    search, plan = DesignSearch([*own, *cheapest], total, progress), design.plan
    for stage in STAGES:
        search.run(replace(plan, power=stage.power, hard=stage.hard), stage.keep or starts, stage.steps)
        plan = _last(design)
    for harder in HARDER:
        if not any((use := design.look(search.best)).broken()):
            return search
        plan = replace(plan, limits=_closer(plan.limits, use), hard=harder)
        search.run(plan, 1, stage.steps)
        search.found = [plan.coefficients(c) for c in search.found]  # which the design's own limits hardly scale
    if search.interrupted and cheapest and any(design.look(search.best).broken()):
        search.found = cheapest
    return search


def _closer(limits: Limits, use: LimitUse) -> Limits:
    """Return limits that are narrower by as much as a motion exceeds them."""
    over = {name: min(FARTHEST, CLOSER * float(share.max())) for name, share in use.largest.items() if share.max() > 1}
    torque = max(over.get("torque", 1.0), over.get("worst-case torque", 1.0))
    rates = {name: getattr(limits, name) / over.get(name, 1.0) for name in ("velocity", "acceleration", "jerk")}
    return replace(limits, **rates, torque=limits.torque / torque, rms_torque=limits.rms_torque / over.get("rms torque", 1.0))


def _last(design: Design) -> Plan:
    """Return the plan that asks for what is minimised in the end."""
    return replace(design.plan, criterion=design.sigma_criterion) if design.criterion == SIGMA else design.plan
