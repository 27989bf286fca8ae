"""Robots, linear in their parameters: column blocks and their sum.

``BLOCKS`` is the table of blocks that fit a robot of any number of joints, or refuse the wrong one.
"""

from identify.basis.armature import Armature as Armature
from identify.basis.balancer import Balancer as Balancer
from identify.basis.basis import Basis as Basis
from identify.basis.block import AbstractBlock as AbstractBlock
from identify.basis.block import AbstractConservativeBlock as AbstractConservativeBlock
from identify.basis.coupled import Coupled as Coupled
from identify.basis.friction.asymmetric_viscous import AsymmetricViscousFriction as AsymmetricViscousFriction
from identify.basis.friction.cogging import Cogging as Cogging
from identify.basis.friction.coulomb import CoulombFriction as CoulombFriction
from identify.basis.friction.load import LoadFriction as LoadFriction
from identify.basis.friction.offset import Offset as Offset
from identify.basis.friction.power_law import PowerFriction as PowerFriction
from identify.basis.friction.power_law import power
from identify.basis.friction.shape import Shape as Shape
from identify.basis.friction.shape import ShapedFriction as ShapedFriction
from identify.basis.friction.smooth_coulomb import ArctanFriction as ArctanFriction
from identify.basis.friction.smooth_coulomb import TanhFriction as TanhFriction
from identify.basis.friction.smooth_coulomb import arctan, tanh
from identify.basis.friction.stribeck import StribeckFriction as StribeckFriction
from identify.basis.friction.stribeck import free_stribeck, stribeck
from identify.basis.friction.temperature import TemperatureFriction as TemperatureFriction
from identify.basis.friction.viscous import ViscousFriction as ViscousFriction
from identify.basis.joint_law import AbstractFriction as AbstractFriction
from identify.basis.joint_law import AbstractJointLaw as AbstractJointLaw
from identify.basis.of_joints import OfJoints as OfJoints
from identify.basis.parameter import Parameter as Parameter
from identify.basis.spring import Spring as Spring
from identify.basis.tree_basis import tree_basis as tree_basis
from identify.basis.tree_links import TreeLinks as TreeLinks
from identify.plugins import PluginTable

BLOCKS: PluginTable[AbstractBlock] = PluginTable(
    "blocks",
    AbstractBlock,  # type: ignore[type-abstract]  # only asked whether an instance is one
    {
        "viscous": ViscousFriction,
        "coulomb": CoulombFriction,
        "offset": Offset,
        "asymmetric-viscous": AsymmetricViscousFriction,
        "stribeck": stribeck,
        "stribeck-free": free_stribeck,
        "power": power,
        "tanh": tanh,
        "arctan": arctan,
        "load": LoadFriction,
        "temperature": TemperatureFriction,
        "cogging": Cogging,
        "armature": Armature,
        "spring": Spring,
        "balancer": Balancer,
    },
)
