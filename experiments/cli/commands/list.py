"""The commands that show what ships: parts that can be combined, and scenarios."""

from rich.table import Table
from rich.text import Text

from idbench.experiments.cli.options.tools import List, WriteScenario
from idbench.experiments.plugin_tables import TABLES, plugin_conflicts
from idbench.experiments.program import program
from idbench.experiments.results.page import Page
from idbench.experiments.results.writing import require_free, write_text
from idbench.identify.plugins import PluginTable
from idbench.sim.scenario.faults import FAULTS
from idbench.sim.scenario.scenario_file import designed, load, names, to_toml


def list_plugins(options: List) -> None:
    """Print every plug-in with the first line of its documentation."""
    page = Page(machine=options.json)
    for table in TABLES:
        grid = Table.grid(padding=(0, 2))
        for name in table:
            grid.add_row(f"  {name}", Text(table.summary(name)))
        added = f" (entry points: idbench.{table.point})" if isinstance(table, PluginTable) else ""
        page.print(Text(f"{table.point}{added}", style="bold"), grid, sep="\n")
    grid = Table.grid(padding=(0, 2))
    for name, flaw in FAULTS.items():
        grid.add_row(f"  {name}", Text(f"{flaw.what}{f' [{flaw.unit}]' if flaw.unit else ''}"))
    page.print(Text("faults ([[fault]] of a scenario)", style="bold"), grid, sep="\n")
    for conflict in plugin_conflicts():
        page.print(Text(f"warning: {conflict}"), soft_wrap=True)
    page.found |= {table.point: {name: table.summary(name) for name in table} for table in TABLES}
    page.found["faults"] = {name: flaw.what for name, flaw in FAULTS.items()}
    page.close()


def write_scenario(options: WriteScenario) -> None:
    """Write a scenario out, or list those that ship."""
    page = Page()
    if options.name is None:
        width = max(map(len, names()))
        for known in names():
            page.out(f"{known:{width}}  {load(known).origin}")
        page.out(f"{len(designed())} more for the studies of excitation, such as {designed()[0]}: excited/ROBOT-MOTION")
    elif options.out is None:
        page.out(to_toml(load(options.name)).rstrip("\n"))
    else:
        require_free(options.out, "--out", force=options.force)
        write_text(options.out, to_toml(load(options.name)), "--out", force=options.force)
        page.out(f"written to {options.out}; run it: {program()} run {options.out}")
    page.close()
