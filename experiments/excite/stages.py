"""The stages of a search: soft and smooth limits first, then those that are."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from experiments.excite.design import SIGMA, Design
from identify import Array
from identify.design.plan import POWER, Plan
from identify.design.search import Search

STARTS, BASINS = 5, 12
"""Least starts of the search, and starts times joints: few joints take little time."""


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
"""What exceeding limits costs while some are still broken; those of torques also become narrower, by as much as is exceeded:
between the states that the search looks at torques may be larger, where a joint turns."""

CLOSER = 1.005
"""Factor by which limits of torques become narrower than what they are exceeded by."""


def searched(design: Design, random: Sequence[Array], progress: Callable[[float], None] | None = None) -> Search:
    """Return the search of the best motion, begun with the best of random ones and those of the kind's own."""
    rng, starts = np.random.default_rng([design.seed, 2]), max(STARTS, BASINS // design.subject.robot.n)
    own = design.excitation.starts(rng, design.plan, design.duration, design.frequency, starts - bool(random))
    cheapest = sorted(random, key=lambda c: design.plan.value(c)[0])[:1]
    total = sum((stage.keep or starts) * stage.steps for stage in STAGES)
    search, plan = Search([*own, *cheapest], total, progress), design.plan
    for stage in STAGES:
        search.run(replace(plan, power=stage.power, hard=stage.hard), stage.keep or starts, stage.steps)
        plan = _last(design)
    for harder in HARDER:
        if not any((use := design.look(search.best)).broken()):
            return search
        over = max(1.0, *(CLOSER * float(share.max()) for name, share in use.largest.items() if "torque" in name), 1.0)
        limits = replace(plan.limits, torque=plan.limits.torque / over, rms_torque=plan.limits.rms_torque / over)
        plan = replace(plan, limits=limits, hard=harder)
        search.run(plan, 1, stage.steps)
    if search.interrupted and cheapest and any(design.look(search.best).broken()):
        search.found = cheapest
    return search


def _last(design: Design) -> Plan:
    """Return the plan that asks for what is minimised in the end."""
    return replace(design.plan, criterion=design.sigma_criterion) if design.criterion == SIGMA else design.plan
