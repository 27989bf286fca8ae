"""Controllers, and their table."""

from identify.plugins import PluginTable
from sim.controllers.computed_torque import ComputedTorque as ComputedTorque
from sim.controllers.controller import AbstractController as AbstractController
from sim.controllers.controller import AbstractLaw as AbstractLaw
from sim.controllers.controller import Task as Task
from sim.controllers.pd import PDFeedforward as PDFeedforward
from sim.controllers.pid import PID as PID
from sim.controllers.position import PositionCommand as PositionCommand

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
