"""What a result says, described once: the screen, the page of a report and Python show the same."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from importlib.metadata import version

from rich.console import Console
from rich.text import Text

from idbench.experiments.text import new_table, print_titled

COLORS = {"good": "green", "fair": "yellow", "poor": "red"}  # Of the verdicts


@dataclass(frozen=True)
class Conclusion:
    """The first lines of every result, which terminal, report, recording and Python share."""

    word: str
    """The verdict; empty if there is none."""
    finding: str
    """The verdict in one sentence."""
    step: str
    """What to do next."""
    why: str = ""
    """What limits it, in a line of its own."""

    @property
    def lines(self) -> list[str]:
        """Its lines, as they are printed."""
        return [*filter(None, (self.finding, self.why)), f"next: {self.step}"]

    def __str__(self) -> str:
        return "; ".join(self.lines)

    def show(self, console: Console) -> None:
        """Print it."""
        first, *others = self.lines
        console.print(Text(first, f"bold {COLORS.get(self.word, '')}".strip()), soft_wrap=True)
        console.print(Text("\n".join(others) + "\n", "bold"), soft_wrap=True)

    def markdown(self, command: str) -> str:
        """The same for a recording, with the command that makes the result again."""
        return "\n\n".join([f"**{self.finding}**", *self.lines[1:], f"`{command}`"])

    def summary(self) -> dict[str, str]:
        """Its part of summary.json."""
        return {"verdict": self.word, "finding": self.finding, "why": self.why, "next": self.step}


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
    conclusion: Conclusion
    """What it comes to, and the next step."""
    verdicts: Sequence[tuple[str, str]]
    """Lines on its parts, each after its verdict."""
    warnings: Mapping[str, Sequence[str]]
    """What to check, by what it is about."""
    tables: Sequence[Listing]
    """What was found."""
    notes: Sequence[str]
    """What else belongs to it: what was read and assumed."""
    figures: Callable[[], Sequence[tuple[str, str]]] = tuple
    """Makes titles and SVG of its pictures."""

    def page(self, command: str) -> str:
        """Page of one HTML file, with the command that makes the result again."""
        from idbench.experiments.reports.figures import rendered  # what draws pictures is not loaded for a few lines of text

        shown = {"document": self, "figures": self.figures(), "command": command, "version": version("idbench")}
        return rendered("idbench.experiments.reports", "plain.html.j2", title=self.title, **shown)
