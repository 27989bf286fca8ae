"""Drives, and their table."""

from identify.plugins import PluginTable
from sim.drives.averaged_drive import AveragedDrive as AveragedDrive
from sim.drives.drive import AbstractAmplifier as AbstractAmplifier
from sim.drives.drive import AbstractDrive as AbstractDrive
from sim.drives.ideal_drive import IdealDrive as IdealDrive
from sim.drives.servo_drive import ServoDrive as ServoDrive
from sim.drives.switched_drive import SwitchedDrive as SwitchedDrive

DRIVES: PluginTable[AbstractDrive] = PluginTable(
    "drives",
    AbstractDrive,  # type: ignore[type-abstract]  # only asked whether an instance is one
    {
        "ideal": IdealDrive,
        "averaged": AveragedDrive,
        "switched": SwitchedDrive,
        "servo": ServoDrive,
    },
)
