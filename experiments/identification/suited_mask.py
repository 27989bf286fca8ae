"""A mask that reaches as far as the friction of slow motion is not that of faster motion."""

from dataclasses import replace

import numpy as np

from experiments.identification.request import Request
from identify import ESTIMATORS, IdentificationError, MotionLog, ReversalMask
from identify.judge.slow_motion import slow_motion


def with_suited_mask(request: Request, logs: tuple[MotionLog, ...]) -> tuple[Request, tuple[int, ...]]:
    """Return a request with speeds of the mask that suit the logs, and the joints of which they are higher than usual.

    As it was, if speeds are given, nothing is masked, or nothing can be estimated, which the fit says.
    """
    mask = request.processing.mask
    if not isinstance(mask, ReversalMask) or mask.threshold is not None:
        return request, ()
    try:
        problem = request.problem(logs).explicit
        speed, factor = slow_motion(problem, ESTIMATORS.create("WLS").fit(problem).X)
    except IdentificationError:
        return request, ()
    raised = tuple(int(j) for j in np.flatnonzero(factor > 1))
    return (replace(request, mask_speed=tuple((speed * factor).tolist())), raised) if raised else (request, ())
