"""The command that prints what a shell needs to complete the others."""

from contextlib import redirect_stdout, suppress
from io import StringIO

from rich.text import Text
from tyro.extras import SubcommandApp

from idbench.experiments.cli.app import COMMANDS
from idbench.experiments.cli.options.tools import Completion
from idbench.experiments.cli.parser import typed
from idbench.experiments.results.page import new_page


def complete(options: Completion) -> None:
    """Print a script that completes commands, options and their values."""
    every, script = SubcommandApp(), StringIO()
    for name, each in COMMANDS.items():
        every.command(name=name)(typed(each))
    with redirect_stdout(script), suppress(SystemExit):  # the parser ends its process after the script
        every.cli(prog="idbench", args=["--tyro-print-completion", options.shell])
    page = new_page()
    page.print(Text(script.getvalue()), soft_wrap=True)
    page.close()
