"""A command: its options, and the function that does its work, which is loaded when it is called."""

from importlib import import_module
from typing import ClassVar

from idbench.experiments.cli.interruption import importing


class Command:
    """Options of a command; calling them does its work."""

    action: ClassVar[str] = ""
    """File of `idbench.experiments.cli.commands` and function, as in log:show_log; it receives the options."""

    def __init_subclass__(cls, action: str = "") -> None:
        cls.action = action or cls.action

    def __call__(self) -> None:
        """Do the work."""
        module, _, name = self.action.partition(":")
        with importing():
            function = getattr(import_module(f"idbench.experiments.cli.commands.{module}"), name)
        function(self)
