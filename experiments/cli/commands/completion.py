"""The command that prints a script for a shell."""

from rich.text import Text

from idbench.experiments.cli.app import DESCRIPTION
from idbench.experiments.cli.command import COMMANDS
from idbench.experiments.cli.options.tools import Completion
from idbench.experiments.cli.parser import every_command
from idbench.experiments.results.page import Page


def complete(options: Completion) -> None:
    """Print the script; bash names files where there are no words."""
    page, script = Page(), every_command(COMMANDS, DESCRIPTION).generate_completion(shell=options.shell)
    page.print(Text(script.replace("complete -F ", "complete -o default -F ")), soft_wrap=True)
    page.close()
