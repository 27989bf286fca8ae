"""The commands that authors of scenarios, studies and plug-ins begin with."""

from pathlib import Path

from rich.text import Text

from idbench.experiments.cli.options.tools import Check, New
from idbench.experiments.contracts.contract import Example
from idbench.experiments.contracts.contracts import found, keeps
from idbench.experiments.errors import ExperimentError
from idbench.experiments.program import program
from idbench.experiments.results.page import Page, stages_of
from idbench.experiments.starters.starters import new_example, new_plugin, new_scenario, new_study


def begin(options: New) -> None:
    """Write what to start from."""
    folder = options.what in ("plugin", "example")
    page, out = Page(), options.out or Path(options.name if folder else f"{options.name}.toml")
    if options.what == "scenario":
        new_scenario(options.name, options.like, out)
        how = f"{program()} run {out}"
    elif options.what == "study":
        new_study(options.name, out)
        how = f"{program()} study {out}"
    elif options.what == "example":
        with stages_of("simulating an arm"):
            new_example(options.name, options.robot, out)
        how = f"{program()} identify {out / 'log.csv'} --robot {out / 'arm.xml'} --torque held --torque-delay estimate"
    else:
        new_plugin(options.name, options.kind, out)
        how = f"uv pip install -e {out}, then: {program()} check {options.name}"
    page.print(Text(f"written to {out}; next: {how}"), soft_wrap=True)
    page.close()


def check(options: Check) -> None:
    """Print what a plug-in is asked to do, and what of it is kept; raise ExperimentError if something is not."""
    page, (table, plugin) = Page(machine=options.json), found(options.plugin)
    page.print(Text(f"{options.plugin}: {type(plugin).__name__}, of the {table.point}", style="bold"))
    answers = list(keeps(table, plugin, Example()))
    for clause, complaint in answers:
        page.print(Text(f"{'no ' if complaint else 'yes'}  {clause}"), soft_wrap=True)
        if complaint:
            page.print(Text(f"     {complaint}"), soft_wrap=True)
    broken = sum(bool(complaint) for _, complaint in answers)
    page.found |= {"plugin": options.plugin, "point": table.point, "contract": dict(answers)}
    page.close()
    if broken:
        raise ExperimentError(f"{options.plugin} violates {broken} of {len(answers)} parts of its contract")
