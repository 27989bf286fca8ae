"""The command that prints what a shell needs to complete the others."""

from rich.text import Text

from idbench.experiments.cli.app import completion
from idbench.experiments.cli.options.tools import Completion
from idbench.experiments.results.page import new_page


def complete(options: Completion) -> None:
    """Print a script that completes commands, options and their values."""
    page = new_page()
    page.print(Text(completion(options.shell)), soft_wrap=True)
    page.close()
