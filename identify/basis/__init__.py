"""Robots, linear in their parameters: column blocks and their sum.

``BLOCKS`` is the table of blocks that fit a robot of any number of joints, or refuse the wrong one.
"""

from identify.basis.armature import Armature as Armature
from identify.basis.basis import Basis as Basis
from identify.basis.block import AbstractBlock as AbstractBlock
from identify.basis.block import AbstractConservativeBlock as AbstractConservativeBlock
from identify.basis.block import AbstractFriction as AbstractFriction
from identify.basis.coulomb_friction import CoulombFriction as CoulombFriction
from identify.basis.offset import Offset as Offset
from identify.basis.parameter import Parameter as Parameter
from identify.basis.scara_links import ScaraLinks as ScaraLinks
from identify.basis.scara_links import scara as scara
from identify.basis.tree_basis import tree_basis as tree_basis
from identify.basis.tree_links import TreeLinks as TreeLinks
from identify.basis.viscous_friction import ViscousFriction as ViscousFriction
from identify.plugins import PluginTable

BLOCKS: PluginTable[AbstractBlock] = PluginTable(
    "blocks",
    AbstractBlock,  # type: ignore[type-abstract]  # only asked whether an instance is one
    {
        "scara": ScaraLinks,
        "viscous": ViscousFriction,
        "coulomb": CoulombFriction,
        "offset": Offset,
        "armature": Armature,
    },
)
