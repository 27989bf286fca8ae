"""The basis of any tree of links."""

from collections.abc import Iterator

import numpy as np

from idbench.identify.basis.armature import Armature
from idbench.identify.basis.basis import Basis
from idbench.identify.basis.block import AbstractBlock
from idbench.identify.basis.coupled import Coupled
from idbench.identify.basis.friction.coulomb import CoulombFriction
from idbench.identify.basis.friction.tied import TiedFriction
from idbench.identify.basis.friction.viscous import ViscousFriction
from idbench.identify.basis.joint_law import AbstractFriction
from idbench.identify.basis.of_joints import OfJoints
from idbench.identify.basis.spring import Spring
from idbench.identify.basis.tree_links import TreeLinks
from idbench.identify.data.kinematics import KinematicTree


def tree_basis(tree: KinematicTree, laws: tuple[AbstractBlock, ...] = (ViscousFriction(), CoulombFriction())) -> Basis:
    """Return links, armatures and springs where the tree has them, and laws of friction: the standard parameters, by joint.

    Drives that turn with several joints have an armature and the laws of friction, too.

    Friction laws are added as to any basis, as in ``tree_basis(tree) + Offset()``. Standard parameters cannot all be
    identified: `BaseParameters` groups them.

    Examples
    --------
    >>> from idbench.identify import BaseParameters, tree_basis
    >>> from idbench.sim import kinematic_tree, load_robot
    >>> tree = kinematic_tree(load_robot("scara"))
    >>> basis = tree_basis(tree)
    >>> len(basis.names), BaseParameters.of(tree, basis).names
    (25, ('ZZR1', 'Fv1', 'Fs1', 'ZZ2', 'MX2', 'MY2', 'Fv2', 'Fs2'))
    """
    driven = tuple(j for j, joint in enumerate(tree.joints) if joint.armature)
    sprung = {j: joint.spring for j, joint in enumerate(tree.joints) if joint.spring is not None}
    rest = tuple(sprung.get(j, 0.0) for j in range(tree.n))
    springs = (Spring(rest, tuple(sprung)),) if sprung else ()
    blocks = TreeLinks(tree), Armature(driven), *springs, *laws, *_of_couplings(tree, laws)
    parameters = [parameter for block in blocks for parameter in block.parameters(tree.n)]
    kept = tuple(sorted(parameters, key=lambda p: -1 if p.joint is None else p.joint))
    slides = tuple(j for j, joint in enumerate(tree.joints) if joint.kind == "slide")
    return Basis(tree.n, blocks, kept, slides)


def _of_couplings(tree: KinematicTree, laws: tuple[AbstractBlock, ...]) -> Iterator[AbstractBlock]:
    """Yield what drives that turn with several joints have: rotor, spring, and laws of friction that all these joints have.

    Those are laws of motion alone: a load is a joint's.
    """
    for coupling in tree.couplings:
        if coupling.armature:
            yield Coupled(Armature(), coupling)
        if coupling.spring is not None:
            yield Coupled(Spring((coupling.spring,)), coupling)
        turned = set(np.flatnonzero(coupling.weights).tolist())
        inner = [law.block if isinstance(law, OfJoints) and turned <= set(law.joints) else law for law in laws]
        own = [law for law in inner if isinstance(law, AbstractFriction)]
        yield from (Coupled(law, coupling) for law in own)
        if any(isinstance(law, CoulombFriction) for law in own) and len(turned) > 1:
            yield TiedFriction(coupling)
