"""What can be combined."""

from rich.console import Console
from rich.table import Table
from rich.text import Text

from idbench.experiments.cli.options.tools import List
from idbench.experiments.plugin_tables import TABLES, plugin_conflicts
from idbench.experiments.results.page import Page
from idbench.identify.plugins import PluginTable


def list_plugins(options: List) -> None:
    """List every plug-in."""
    page = Page(machine=options.json)
    print_plugins(page)
    page.found |= {table.point: {name: table.summary(name) for name in table} for table in TABLES}
    page.close()


def print_plugins(console: Console) -> None:
    """Print every plug-in with the first line of its documentation."""
    for table in TABLES:
        grid = Table.grid(padding=(0, 2))
        for name in table:
            grid.add_row(f"  {name}", Text(table.summary(name)))
        added = f" (entry points: idbench.{table.point})" if isinstance(table, PluginTable) else ""
        console.print(Text(f"{table.point}{added}", style="bold"), grid, sep="\n")
    for conflict in plugin_conflicts():
        console.print(Text(f"warning: {conflict}"), soft_wrap=True)
