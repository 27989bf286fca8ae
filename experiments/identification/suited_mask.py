"""A mask that reaches as far as the friction of slow motion is not that of faster motion."""

import numpy as np

from identify import ESTIMATORS, IdentificationError, Problem, ReversalMask
from identify.judge.slow_motion import slow_motion


def suited_mask(problem: Problem) -> tuple[tuple[float, ...], tuple[int, ...]]:
    """Return speeds of the mask that suit the logs, and the joints of which they are higher than usual.

    Neither, if the speeds are given, nothing is masked, or nothing can be estimated, which the fit says.
    """
    mask = problem.chain.mask
    if not isinstance(mask, ReversalMask) or mask.threshold is not None:
        return (), ()
    try:
        explicit = problem.explicit
        speed, factor = slow_motion(explicit, ESTIMATORS.create("WLS").fit(explicit).X)
    except IdentificationError:
        return (), ()
    raised = tuple(int(j) for j in np.flatnonzero(factor > 1))
    return (tuple((speed * factor).tolist()), raised) if raised else ((), ())
