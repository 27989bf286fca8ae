"""Controllers, and their table."""

from idbench.identify.plugins import PluginTable
from idbench.sim.controllers.computed_torque import ComputedTorque as ComputedTorque
from idbench.sim.controllers.controller import AbstractController as AbstractController
from idbench.sim.controllers.controller import AbstractLaw as AbstractLaw
from idbench.sim.controllers.controller import Task as Task
from idbench.sim.controllers.pd import PDFeedforward as PDFeedforward
from idbench.sim.controllers.pid import PID as PID
from idbench.sim.controllers.position import PositionCommand as PositionCommand

CONTROLLERS: PluginTable[AbstractController] = PluginTable(
    "controllers",
    AbstractController,  # type: ignore[type-abstract]  # only asked whether an instance is one
    {
        "pd": PDFeedforward,
        "pid": PID,
        "computed_torque": ComputedTorque,
        "position": PositionCommand,
    },
)
