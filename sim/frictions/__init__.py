"""Frictions, and their table."""

from identify.plugins import PluginTable
from sim.frictions.coulomb_law import CoulombViscous as CoulombViscous
from sim.frictions.friction_law import AbstractContact as AbstractContact
from sim.frictions.friction_law import AbstractFrictionLaw as AbstractFrictionLaw
from sim.frictions.lugre import LuGre as LuGre
from sim.frictions.stribeck import Stribeck as Stribeck

FRICTIONS: PluginTable[AbstractFrictionLaw] = PluginTable(
    "frictions",
    AbstractFrictionLaw,  # type: ignore[type-abstract]  # only asked whether an instance is one
    {
        "coulomb": CoulombViscous,
        "stribeck": Stribeck,
        "lugre": LuGre,
    },
)
