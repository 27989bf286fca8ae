"""A mask that reaches as far as the friction of slow motion is not that of faster motion."""

import numpy as np

from identify import ESTIMATORS, IdentificationError, Problem, ReversalMask
from identify.basis.friction.shape import ShapedFriction
from identify.basis.of_joints import OfJoints
from identify.judge.slow_motion import slow_motion

SHOWN = 0.02
"""Share of the force of a law at its largest that some row must have for the rows to show it."""


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


def masked_laws(problem: Problem) -> tuple[str, ...]:
    """Return the parameters of laws that act in slow motion only, of joints in which all that is masked.

    Stribeck friction that no row shows could have any size, and would be added to the torque of slow motion.
    """
    rows, basis, found = problem.explicit.some_rows, problem.basis, list[str]()
    for block in basis.blocks:
        inner, joints = (block.block, block.joints) if isinstance(block, OfJoints) else (block, range(basis.n))
        if not isinstance(inner, ShapedFriction):
            continue
        own = [p for p in basis.parameters if p.symbol in inner.letters() and p.joint in joints]
        sizes = {p.joint: np.abs(rows.W[..., basis.places[p]]).max() for p in own if p.symbol == inner.law.symbol}
        found += [p.name for p in own if sizes.get(p.joint, 1.0) < SHOWN]
    return tuple(found)
