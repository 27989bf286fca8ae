"""Robots, linear in their parameters: column blocks and their sum.

``BLOCKS`` is the table of blocks that fit a robot of any number of joints, or refuse the wrong one.
"""

from idbench.identify.basis.basis import Basis as Basis
from idbench.identify.basis.block import AbstractBlock as AbstractBlock
from idbench.identify.basis.block import AbstractConservativeBlock as AbstractConservativeBlock
from idbench.identify.basis.block import Parameter as Parameter
from idbench.identify.basis.friction.laws import AsymmetricViscousFriction as AsymmetricViscousFriction
from idbench.identify.basis.friction.laws import Cogging as Cogging
from idbench.identify.basis.friction.laws import CoulombFriction as CoulombFriction
from idbench.identify.basis.friction.laws import Offset as Offset
from idbench.identify.basis.friction.laws import SmoothFriction as SmoothFriction
from idbench.identify.basis.friction.laws import TemperatureFriction as TemperatureFriction
from idbench.identify.basis.friction.laws import ViscousFriction as ViscousFriction
from idbench.identify.basis.friction.laws import arctan, tanh
from idbench.identify.basis.friction.load import LoadFriction as LoadFriction
from idbench.identify.basis.friction.shape import Shape as Shape
from idbench.identify.basis.friction.shape import ShapedFriction as ShapedFriction
from idbench.identify.basis.friction.shape import StribeckFriction as StribeckFriction
from idbench.identify.basis.friction.shape import free_stribeck, power, stribeck
from idbench.identify.basis.joint_law import AbstractFriction as AbstractFriction
from idbench.identify.basis.joint_law import AbstractJointLaw as AbstractJointLaw
from idbench.identify.basis.joint_law import Armature as Armature
from idbench.identify.basis.of_joints import OfJoints as OfJoints
from idbench.identify.basis.springs import Balancer as Balancer
from idbench.identify.basis.springs import Spring as Spring
from idbench.identify.basis.tree_links import TreeLinks as TreeLinks
from idbench.identify.basis.tree_links import tree_basis as tree_basis
from idbench.identify.plugins import PluginTable

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
        "smooth": SmoothFriction,
        "armature": Armature,
        "spring": Spring,
        "balancer": Balancer,
    },
)
