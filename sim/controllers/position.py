"""Positions as commands: for joints that close their loop themselves."""

from typing import ClassVar, final

from idbench.sim.controllers.controller import AbstractController, AbstractLaw, Task
from idbench.sim.drives.drive import Commanded, every
from idbench.sim.robot.motors import Array
from idbench.sim.settings import settings


@final
@settings
class PositionCommand(AbstractController):
    """The planned positions, sent to servos."""

    commanded: ClassVar[Commanded] = "position"

    def start(self, task: Task) -> AbstractLaw:
        """Return the commands of a motion."""
        return _Law(task)


class _Law(AbstractLaw):
    def __init__(self, task: Task) -> None:
        planned = task.reference.q
        self._planned = planned if planned.ndim == 3 else [every(q, task.nsim) for q in planned]

    def command(self, k: int, q: Array) -> Array:
        del q
        return self._planned[k]
