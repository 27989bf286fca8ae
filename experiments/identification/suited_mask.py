"""A mask that reaches as far as the friction of slow motion is not that of faster motion."""

import numpy as np

from idbench.identify import ESTIMATORS, IdentificationError, Problem, ReversalMask
from idbench.identify.arrays import TINY
from idbench.identify.basis.friction.shape import ShapedFriction
from idbench.identify.basis.of_joints import OfJoints
from idbench.identify.basis.parameter import Parameter
from idbench.identify.judge.slow_motion import slow_motion
from idbench.identify.rows.rows import Rows

SHOWN = 0.02
"""Share of the largest entry of a law's column that a mask must leave for the rows to show the law."""


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


def masked_laws(before: Problem, after: Problem) -> tuple[str, ...]:
    """Return the parameters of laws that act in slow motion only, where a mask that reaches farther takes all that.

    Stribeck friction that no row shows could have any size, and would be added to the torque of slow motion.
    """
    basis, found = after.basis, list[str]()
    rows, usual = after.explicit.some_rows, before.explicit.some_rows
    for block in basis.blocks:
        inner, joints = (block.block, block.joints) if isinstance(block, OfJoints) else (block, range(basis.n))
        if not isinstance(inner, ShapedFriction):
            continue
        own = [p for p in basis.parameters if p.symbol in inner.letters() and p.joint in joints]
        sizes = {p.joint: _largest(rows, p) / max(_largest(usual, p), TINY) for p in own if p.symbol == inner.law.symbol}
        found += [p.name for p in own if sizes.get(p.joint, 1.0) < SHOWN]
    return tuple(found)


def _largest(rows: Rows, parameter: Parameter) -> float:
    """Return the largest entry of a column, by size."""
    return float(np.abs(rows.W[..., rows.names.index(parameter.name)]).max())
