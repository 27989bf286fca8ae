"""Frictions, and their table."""

from idbench.identify.plugins import PluginTable
from idbench.sim.frictions.asymmetric import Asymmetric as Asymmetric
from idbench.sim.frictions.coulomb_law import CoulombViscous as CoulombViscous
from idbench.sim.frictions.dahl import Dahl as Dahl
from idbench.sim.frictions.friction_law import AbstractContact as AbstractContact
from idbench.sim.frictions.friction_law import AbstractFrictionLaw as AbstractFrictionLaw
from idbench.sim.frictions.load import LoadDependent as LoadDependent
from idbench.sim.frictions.lugre import LuGre as LuGre
from idbench.sim.frictions.stribeck import Stribeck as Stribeck
from idbench.sim.frictions.temperature import Warming as Warming

FRICTIONS: PluginTable[AbstractFrictionLaw] = PluginTable(
    "frictions",
    AbstractFrictionLaw,  # type: ignore[type-abstract]  # only asked whether an instance is one
    {
        "coulomb": CoulombViscous,
        "stribeck": Stribeck,
        "asymmetric": Asymmetric,
        "load": LoadDependent,
        "warming": Warming,
        "lugre": LuGre,
        "dahl": Dahl,
    },
)
