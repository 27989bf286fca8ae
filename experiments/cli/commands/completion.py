"""The command that prints a script for a shell."""

from rich.text import Text

from idbench import models
from idbench.experiments.cli.app import DESCRIPTION
from idbench.experiments.cli.command import COMMANDS
from idbench.experiments.cli.options.tools import Completion
from idbench.experiments.cli.parser import every_command
from idbench.experiments.identification.friction_laws import AUTO, GROUPS, SMOOTH
from idbench.experiments.results.page import Page
from idbench.experiments.study.study_file import names as studies
from idbench.identify import BLOCKS, CHAINS, ESTIMATORS, MODELS
from idbench.sim.scenario.scenario_file import names as scenarios


def complete(options: Completion) -> None:
    """Print the script; bash names files where there are no words."""
    names = {key: [*scenarios()] for key in ("loop", "like", "scenario")} | {"study": [*studies()], "robot": [*models.names()]}
    names |= {"model": [*MODELS, "all"], "chain": [*CHAINS], "estimator": [*ESTIMATORS], "add": [*BLOCKS]}
    names["friction"] = [AUTO, SMOOTH, *GROUPS, *BLOCKS]
    page, script = Page(), every_command(COMMANDS, DESCRIPTION, names).generate_completion(shell=options.shell)
    page.print(Text(script.replace("complete -F ", "complete -o default -F ")), soft_wrap=True)
    page.close()
