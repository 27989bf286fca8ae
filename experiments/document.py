"""What a result says, described once: the screen, the page of a report and Python show the same."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from importlib.metadata import version

from rich.console import Console

from idbench.experiments.text import new_table, print_titled


@dataclass(frozen=True)
class Listing:
    """A table whose first column has names."""

    title: str
    """Above it."""
    heads: tuple[str, ...]
    """Above the columns; those that begin with the same line stay together."""
    rows: tuple[tuple[str, ...], ...]
    """Cells, those of names first."""
    stub: int = 1
    """Columns that stand in every part where a screen is too narrow for all of them."""

    def show(self, console: Console) -> None:
        """Print it."""
        grid = new_table("", self.heads[1:])
        for row in self.rows:
            grid.add_row(*row)
        print_titled(console, self.title, grid, self.stub)


@dataclass(frozen=True, eq=False)
class Document:
    """What a result says."""

    title: str
    """What it is of."""
    subtitle: str
    """Of which robot, or by which loops."""
    verdicts: Sequence[tuple[str, str]]
    """Lines, each after its verdict; the first is that on the whole."""
    warnings: Mapping[str, Sequence[str]]
    """What to check, by what it is about."""
    tables: Sequence[Listing]
    """What was found."""
    notes: Sequence[str]
    """What else belongs to it: what was read and assumed."""
    step: str = ""
    """What to do next."""
    figures: Callable[[], Sequence[tuple[str, str]]] = tuple
    """Makes titles and SVG of its pictures."""

    def page(self, command: str) -> str:
        """Page of one HTML file, with the command that makes the result again."""
        from idbench.experiments.reports.figures import rendered  # what draws pictures is not loaded for a few lines of text

        shown = {"document": self, "figures": self.figures(), "command": command, "version": version("idbench")}
        return rendered("idbench.experiments.reports", "plain.html.j2", title=self.title, **shown)
