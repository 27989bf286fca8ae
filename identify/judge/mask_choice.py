"""Which joints need a wide mask, decided by the logs."""

from dataclasses import replace

import numpy as np

from idbench.identify.errors import LogError
from idbench.identify.estimators.leave_out import Stretches
from idbench.identify.estimators.problem import Problem
from idbench.identify.judge.used_rows import UsedRows, errors_left_out
from idbench.identify.models import ExplicitModel
from idbench.identify.rows.rows import manageable
from idbench.identify.signals.masks import ReversalMask

REACHES = (2.0, 4.0)
"""Wide masks that are compared with the short one, in multiples of the slow speed: up to a fifth of the rms speed. A KUKA
KR300 takes 4 in most joints; 1 was never best there, nor on UR10e, TX40 and Baxter."""

SHARE = 0.05
"""Share of a joint's mean absolute error that a wide mask must take to be chosen: it takes 10 to 55 % in five joints of a
KR300, at most 2 % on a UR10e, a TX40 and a Baxter."""


def suited_reach(problem: Problem) -> tuple[float, ...]:
    """Reach of the mask of each joint (`ReversalMask.reach`); empty where the short mask suits all.

    Near reversals the friction of joints with strong stiction is not Fs sign(qd), and rows there spoil the rest; on slow robots
    they are the most informative of all. Each mask is judged by predictions of stretches that were left out, on all rows of
    moving joints, where the written function is used: a wide mask must predict them better than the short one.
    Absolute errors count: no mask makes stiction itself predictable, and its squares would hide how well the rest is.
    """
    mask = problem.chain.mask
    if not isinstance(mask, ReversalMask) or mask.threshold is not None or problem.logs[0].poses:
        return ()
    logs = tuple(manageable(problem.logs))
    explicit = Problem(logs, problem.basis, ExplicitModel(), problem.chain) if problem.long else problem.explicit
    if not (used := UsedRows.of(explicit)):
        return ()
    stretches = Stretches.of(explicit.parts)
    best = errors_left_out(explicit, used, stretches)
    reach = np.zeros(problem.basis.n)
    for wide in REACHES:
        chain = replace(problem.chain, mask=replace(mask, reach=(wide,) * problem.basis.n))
        try:
            errors = errors_left_out(Problem(logs, problem.basis, ExplicitModel(), chain), used, stretches)
        except LogError:  # a short log has no room for wider edges
            break
        for j in range(problem.basis.n):
            if errors[j] < (1 - SHARE) * best[j]:
                best[j], reach[j] = errors[j], wide
    return tuple(reach.tolist()) if reach.any() else ()
