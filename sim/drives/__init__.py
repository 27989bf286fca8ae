"""Drives, and their table."""

from identify.plugins import PluginTable
from sim.drives.averaged import AveragedDrive as AveragedDrive
from sim.drives.base import AbstractAmplifier as AbstractAmplifier
from sim.drives.base import AbstractDrive as AbstractDrive
from sim.drives.ideal import IdealDrive as IdealDrive
from sim.drives.switched import SwitchedDrive as SwitchedDrive

DRIVES: PluginTable[AbstractDrive] = PluginTable(
    "drives",
    AbstractDrive,  # type: ignore[type-abstract]  # only asked whether an instance is one
    {
        "ideal": IdealDrive,
        "averaged": AveragedDrive,
        "switched": SwitchedDrive,
    },
)
