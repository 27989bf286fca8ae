"""The basis of any tree of links."""

from identify.basis.armature import Armature
from identify.basis.basis import Basis
from identify.basis.block import AbstractBlock
from identify.basis.coulomb_friction import CoulombFriction
from identify.basis.tree_links import TreeLinks
from identify.basis.viscous_friction import ViscousFriction
from identify.data.kinematics import KinematicTree


def tree_basis(tree: KinematicTree, laws: tuple[AbstractBlock, ...] = (ViscousFriction(), CoulombFriction())) -> Basis:
    """Return links, armatures where the tree has them, and laws of friction: the standard parameters, joint by joint.

    Friction laws are added as to any basis, as in ``tree_basis(tree) + Offset()``. Standard parameters cannot all be
    identified: `BaseParameters` groups them.
    """
    driven = tuple(j for j, joint in enumerate(tree.joints) if joint.armature)
    blocks = TreeLinks(tree), Armature(driven), *laws
    parameters = [parameter for block in blocks for parameter in block.parameters(tree.n)]
    order = tuple(parameter.name for parameter in sorted(parameters, key=lambda p: -1 if p.joint is None else p.joint))
    slides = tuple(j for j, joint in enumerate(tree.joints) if joint.kind == "slide")
    return Basis(tree.n, blocks, order, slides=slides)
