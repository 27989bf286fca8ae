"""Frictions, and their table."""

from idbench.identify.plugins import PluginTable
from idbench.sim.frictions.friction_law import AbstractContact as AbstractContact
from idbench.sim.frictions.friction_law import AbstractFrictionLaw as AbstractFrictionLaw
from idbench.sim.frictions.lugre import Dahl as Dahl
from idbench.sim.frictions.lugre import LuGre as LuGre
from idbench.sim.frictions.static import Asymmetric as Asymmetric
from idbench.sim.frictions.static import CoulombViscous as CoulombViscous
from idbench.sim.frictions.static import Law as Law
from idbench.sim.frictions.static import LoadDependent as LoadDependent
from idbench.sim.frictions.static import Stribeck as Stribeck
from idbench.sim.frictions.static import Warming as Warming

FRICTIONS: PluginTable[AbstractFrictionLaw] = PluginTable(
    "frictions",
    AbstractFrictionLaw,  # type: ignore[type-abstract]  # only asked whether an instance is one
    {
        "coulomb": CoulombViscous,
        "stribeck": Stribeck,
        "asymmetric": Asymmetric,
        "load": LoadDependent,
        "law": Law,
        "warming": Warming,
        "lugre": LuGre,
        "dahl": Dahl,
    },
)
