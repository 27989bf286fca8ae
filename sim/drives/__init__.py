"""Drives, and their table."""

from idbench.identify.plugins import PluginTable
from idbench.sim.drives.averaged_drive import AveragedDrive as AveragedDrive
from idbench.sim.drives.drive import AbstractAmplifier as AbstractAmplifier
from idbench.sim.drives.drive import AbstractDrive as AbstractDrive
from idbench.sim.drives.ideal_drive import IdealDrive as IdealDrive
from idbench.sim.drives.servo_drive import ServoDrive as ServoDrive
from idbench.sim.drives.switched_drive import SwitchedDrive as SwitchedDrive

DRIVES: PluginTable[AbstractDrive] = PluginTable(
    "drives",
    AbstractDrive,  # type: ignore[type-abstract]  # only asked whether an instance is one
    {"ideal": IdealDrive, "averaged": AveragedDrive, "switched": SwitchedDrive, "servo": ServoDrive},
)
