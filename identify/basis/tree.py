"""The basis of any tree of links."""

from identify.basis.armature import Armature
from identify.basis.basis import Basis, joint_number
from identify.basis.coulomb import CoulombFriction
from identify.basis.tree_links import TreeLinks
from identify.basis.viscous import ViscousFriction
from identify.kinematics import KinematicTree


def tree_basis(tree: KinematicTree) -> Basis:
    """Return links, armatures where the tree has them, viscous and Coulomb friction: the standard parameters, joint by joint.

    Friction laws are added as to any basis, as in ``tree_basis(tree) + Offset()``. Standard parameters cannot all be told
    apart: `BaseParameters` groups them.
    """
    driven = tuple(j for j, joint in enumerate(tree.joints) if joint.armature)
    blocks = TreeLinks(tree), Armature(driven), ViscousFriction(), CoulombFriction()
    names = [name for block in blocks for name in block.names(tree.n)]
    order = tuple(sorted(names, key=joint_number))
    slides = tuple(j for j, joint in enumerate(tree.joints) if joint.kind == "slide")
    return Basis(tree.n, blocks, order, slides=slides)
