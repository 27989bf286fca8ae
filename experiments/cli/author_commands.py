"""The commands that authors of scenarios, studies and plug-ins begin with."""

from pathlib import Path

from rich.text import Text

from experiments.cli.authors import Check, New
from experiments.cli.page import new_page, show
from experiments.contracts.contract import Example
from experiments.contracts.contracts import found, keeps
from experiments.errors import ExperimentError
from experiments.starters.starters import new_plugin, new_scenario, new_study


def begin(asked: New) -> None:
    """Write what to start from."""
    page, out = new_page(), asked.out or Path(asked.name if asked.what == "plugin" else f"{asked.name}.toml")
    if asked.what == "scenario":
        new_scenario(asked.name, asked.like, out)
        how = f"uv run idbench run {out}"
    elif asked.what == "study":
        new_study(asked.name, out)
        how = f"uv run idbench study {out}"
    else:
        new_plugin(asked.name, asked.kind, out)
        how = f"uv pip install -e {out}, then: uv run idbench check {asked.name}"
    page.print(Text(f"written to {out}; next: {how}"), soft_wrap=True)
    show(page)


def check(asked: Check) -> None:
    """Print what a plug-in is asked, and what of it is kept; raise ExperimentError if something is not."""
    page, (table, plugin) = new_page(machine=asked.json), found(asked.plugin)
    page.print(Text(f"{asked.plugin}: {type(plugin).__name__}, of the {table.point}", style="bold"))
    answers = list(keeps(table, plugin, Example()))
    for clause, complaint in answers:
        page.print(Text(f"{'no ' if complaint else 'yes'}  {clause}"), soft_wrap=True)
        if complaint:
            page.print(Text(f"     {complaint}"), soft_wrap=True)
    broken = sum(bool(complaint) for _, complaint in answers)
    page.found |= {"plugin": asked.plugin, "point": table.point, "contract": dict(answers)}
    show(page)
    if broken:
        raise ExperimentError(f"{asked.plugin} does not keep {broken} of {len(answers)} parts of its contract")
