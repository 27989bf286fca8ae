"""The planar two-joint SCARA of the paper, in its letters."""

from dataclasses import replace
from functools import cache

import numpy as np

from idbench.identify.basis.basis import Basis
from idbench.identify.basis.parameter import Parameter
from idbench.identify.basis.tree_basis import tree_basis
from idbench.identify.data.kinematics import GROUND, Joint, KinematicTree
from idbench.identify.parameters.base_parameters import BaseParameters

JOINTS = 2


@cache
def scara() -> Basis:
    """Return the paper's SCARA: X = ZZR1 Fv1 Fs1 ZZ2 LMX2 LMY2 Fv2 Fs2 (section 7.1), whatever the length L of link 1.

    ZZR1 = ZZ1 + Ia1 + L^2 M2 (both about joint 1), ZZ2 about joint 2, LMX2 = L MX2 and LMY2 = L MY2. The axes are parallel to
    gravity, so no parameter of it appears. The energy of ZZ2 is 1/2 (qd1 + qd2)^2; the paper prints 1/2 (qd1^2 + qd2^2), which
    neither Eq. 10 nor its own explicit columns agree with.

    Examples
    --------
    >>> from idbench.identify import Offset, scara
    >>> (scara() + Offset()).names[-2:]
    ('off1', 'off2')
    """
    x, _, z = np.eye(3)
    joints = [Joint(f"joint{j + 1}", "hinge", j + GROUND, j * x, np.eye(3), z, 0 * x, armature=False) for j in range(JOINTS)]
    tree = KinematicTree("scara", tuple(joints), -9.81 * z)
    return BaseParameters.of(tree, tree_basis(tree), in_letters_of_the_paper(tree)).basis


def in_letters_of_the_paper(tree: KinematicTree) -> dict[Parameter, Parameter]:
    """Return how the paper writes first moments of link 2 of a SCARA; nothing of another tree."""
    if tree.n != JOINTS:
        return {}
    length = float(np.linalg.norm(tree.joints[1].position))
    plain = [Parameter(letters, 1, "first moment", "kg m") for letters in ("MX", "MY")]
    return {p: replace(p, unit="kg m^2", scale=length, label=f"L{p.symbol}") for p in plain}
