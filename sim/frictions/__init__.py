"""Frictions, and their table."""

from identify.plugins import PluginTable
from sim.frictions.asymmetric import Asymmetric as Asymmetric
from sim.frictions.coulomb_law import CoulombViscous as CoulombViscous
from sim.frictions.dahl import Dahl as Dahl
from sim.frictions.friction_law import AbstractContact as AbstractContact
from sim.frictions.friction_law import AbstractFrictionLaw as AbstractFrictionLaw
from sim.frictions.load import LoadDependent as LoadDependent
from sim.frictions.lugre import LuGre as LuGre
from sim.frictions.stribeck import Stribeck as Stribeck
from sim.frictions.temperature import Warming as Warming

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
