"""Tables and numbers as text."""

from collections.abc import Callable, Iterable, Sequence
from copy import copy
from dataclasses import replace
from io import StringIO
from itertools import groupby
from math import ceil, isnan

import numpy as np
import numpy.typing as npt
from rich import box
from rich.console import Console
from rich.measure import Measurement
from rich.table import Column, Table
from rich.text import Text

Color = Sequence[int]

JOINTS: tuple[Color, ...] = (
    (31, 119, 180),
    (255, 127, 14),
    (23, 190, 207),
    (227, 119, 194),
    (188, 189, 34),
    (140, 86, 75),
    (135, 150, 185),
)
"""Colours of the joints' curves, none of which is a model's; the first two are those of the SCARA's links."""

PRINTED = 160  # Characters of a line in Python
TICKS = 6  # Values that have room beside an axis
NICE = (1.0, 2.0, 2.5, 3.0, 4.0, 5.0, 10.0)  # Steps between the values beside an axis, times a power of ten
ROUNDING = 1e-9  # Share of a step by which a value beside an axis is off as a number

DECADE_STEPS = (1.0,), (1.0, 3.0), (1.0, 2.0, 5.0)
"""Values within a decade that are written beside a logarithmic axis: the first that are more than `ENOUGH`."""

ENOUGH = 2  # Values beside an axis with which it can be read
SIGMAS = 2.0  # Half the width of intervals, in standard errors: 95 %
GREY: Color = (150, 150, 150)  # What was measured, the truth, and marks

FORMS: dict[str, Color] = {
    "explicit": (44, 160, 44),
    "implicit": (148, 103, 189),
    "power": (214, 39, 40),
    "energy": (0, 110, 90),
    "integral": (60, 90, 160),
    "explicit+power": (150, 120, 0),
}
"""Colours of the models."""

UNITS = {"power": "W", "energy": "J", "integral": "N m s"}  # Units of the rows of models that have no torques

AGAIN: dict[str, tuple[Color, ...]] = {
    "explicit": ((190, 230, 120), (0, 150, 150)),
    "implicit": ((215, 190, 240), (90, 100, 230)),
    "power": ((250, 150, 150), (170, 20, 60)),
    "energy": ((120, 190, 170), (0, 70, 60)),
    "integral": ((150, 170, 220), (20, 50, 110)),
    "explicit+power": ((210, 190, 90), (100, 80, 0)),
}
"""Colours of the models in a second and a third identification of a log."""

PLANNED: Color = (240, 200, 60)
MEASURED: Color = (90, 210, 220)  # Colours of the planned arm and of that which the encoders see; the true arm has its own

STATES: dict[str, Color] = {
    "moves": (70, 130, 90),
    "reverses": (200, 150, 50),
    "rests": (150, 60, 60),
    "saturated": (230, 60, 200),
    "used": (70, 130, 90),
    "partly": (200, 150, 50),
    "masked": (150, 60, 60),
}
"""What a joint does, its drive at a limit, and what identification makes of the instant."""

FORM_WIDTHS = {"explicit": 3.5}
"""Widths of the curves of models, 1.5 unless given here: the implicit model's lie on those of the explicit one."""


def joint_colors(n: int) -> list[Color]:
    """Return a colour for each of `n` joints."""
    return [JOINTS[j % len(JOINTS)] for j in range(n)]


def model_color(form: str, identification: int = 0) -> Color:
    """Return the colour of a model in the first, second or third identification of a log; a fourth has that of the second."""
    if not identification or form not in AGAIN:
        return lighter(FORMS.get(form, GREY), identification)
    return AGAIN[form][(identification - 1) % len(AGAIN[form])]


def lighter(color: Color, times: int) -> list[int]:
    """Return `color` moved halfway to white, that many times."""
    return [round(255 - (255 - c) / 2**times) for c in color]


SHADES = {"planned": 2, "measured": 1, "log": 1, "command": 1, "reference": 1}
"""How much lighter than the joint's colour the curves of a kind are; the others have the colour itself."""

WIDTHS = {"planned": 4.0, "reference": 4.0, "command": 4.0, "log": 1.0}
"""Widths of the curves of a kind: what was wanted is a broad band behind what has come of it."""


def kind_colors(kind: str, n: int) -> list[list[int]]:
    """Return the colours of `n` joints' curves of a kind."""
    return [lighter(color, SHADES.get(kind, 0)) for color in joint_colors(n)]


WORTHLESS = 999.0  # Percentages from here on all say the same


def percent_reach(shares: npt.ArrayLike, most: float = np.inf) -> float:
    """Half width of an axis [%] that shows differences in % of values, of those that are below `most`.

    100 % at most, and where nothing is known.
    """
    every = np.asarray(shares, dtype=np.float64)
    known = every[np.isfinite(every) & (every < most)]
    return float(np.clip(1.1 * known.max(), 0.01, 100.0)) if known.size else 100.0


def of_each(said: Iterable[tuple[str, str]]) -> dict[str, str]:
    """Lines that name the logs, or the joints, of each sentence, by the sentence."""
    names: dict[str, list[str]] = {}
    for name, words in said:
        names.setdefault(words, []).append(name)
    return {words: f"{', '.join(of)}: {words}" for words, of in names.items()}


def new_table(title: str, columns: Iterable[str]) -> Table:
    """Return an empty table, its first column of names, the others of numbers."""
    grid = Table(
        title=title,
        title_justify="left",
        title_style="bold",
        box=box.SIMPLE_HEAD,
        show_edge=False,
        pad_edge=False,
        padding=(0, 1, 0, 0),
    )
    grid.add_column("", no_wrap=True)
    for heading in columns:
        grid.add_column(heading, justify="right", no_wrap=True)
    return grid


def print_titled(console: Console, title: str, grid: Table, stub: int = 1) -> None:
    """Print a table below a title that may be wider than it."""
    console.print(Text(title, style="bold"), soft_wrap=True)
    print_table(console, grid, stub)


def print_table(console: Console, grid: Table, stub: int = 1) -> None:
    """Print a table, in several below each other where it is wider than the console.

    Columns with the same first line of their heading stay together; the first `stub` columns stand in every part.
    """
    groups = [list(group) for _, group in groupby(grid.columns[stub:], lambda column: str(column.header).partition("\n")[0])]
    free = console.options.update(max_width=10_000)
    while groups:
        taken = [groups.pop(0)]
        while groups and Measurement.get(console, free, _of_columns(grid, stub, [*taken, groups[0]])).maximum <= console.width:
            taken.append(groups.pop(0))
        console.print(_of_columns(grid, stub, taken))


def _of_columns(grid: Table, stub: int, groups: Sequence[Sequence[Column]]) -> Table:
    """Return a table of some of the columns."""
    chosen = [*grid.columns[:stub], *(column for group in groups for column in group)]
    made = copy(grid)
    made.columns = [replace(column, _index=k) for k, column in enumerate(chosen)]
    return made


def markdown(title: str, heads: Sequence[str], rows: Iterable[list[str]]) -> str:
    """Return a table as markdown, its first column of names, the others of numbers."""
    lines = [f"| {' | '.join(cells)} |" for cells in (["", *heads], ["---", *["---:"] * len(heads)], *rows)]
    return "\n".join([f"{title}\n", *lines])


def number(x: float) -> str:
    """Return a number to five digits, a small one to three."""
    return f"{x:#.5g}" if abs(x) >= 1e-3 or x == 0 else f"{x:.2e}"


def percent(share: float) -> str:
    """Return a signed percentage to two decimals, to none from a hundred on, to one digit below a hundredth."""
    size = abs(share)
    if isnan(share):
        return ""
    if size >= WORTHLESS:
        return f"{'-' if share < 0 else ''}>{WORTHLESS:g}"
    return f"{share:+.0f}" if size >= 100 else f"{share:+.2f}" if size >= 0.01 else f"{share:+.0e}" if size else "0"


def with_unit(name: str, unit: str) -> str:
    """Return a name with its unit in brackets, if there is one."""
    return f"{name} [{unit.replace('^2', '²')}]" if unit else name


def round_values(low: float, high: float) -> npt.NDArray[np.float64]:
    """Return round values between the ends of an axis, low < high, `TICKS` at most."""
    least = (high - low) / (TICKS - 1)
    power = 10.0 ** np.floor(np.log10(least))
    step = power * min(x for x in NICE if x * power >= least * (1 - ROUNDING))
    return np.asarray(step * np.arange(np.ceil(low / step - ROUNDING), np.floor(high / step + ROUNDING) + 1) + 0.0)  # no -0


def decade_values(low: float, high: float) -> npt.NDArray[np.float64]:
    """Return round values for a logarithmic axis, 0 < low < high: powers of ten if there are some, and others between them.

    Those of an axis that is too short for them are equally far apart.
    """
    powers = np.arange(np.floor(np.log10(low) + ROUNDING), np.floor(np.log10(high) + ROUNDING) + 1)
    every = max(1, ceil(np.count_nonzero(powers >= np.log10(low) - ROUNDING) / TICKS))
    for steps in DECADE_STEPS:
        found = np.outer(10.0 ** powers[powers % every == 0], steps).ravel()
        found = found[(found >= low * (1 - ROUNDING)) & (found <= high * (1 + ROUNDING))]
        if len(found) > ENOUGH:
            return found
    return round_values(low, high)


def percentage(x: float) -> str:
    """Return a percentage without a sign, to two digits; empty if it is not known."""
    return f"{x:.2g}" if x < 99.5 else f"{x:.0f}" if x < WORTHLESS else f">{WORTHLESS:g}" if x >= WORTHLESS else ""


def relative(x: float, sigma: float) -> str:
    """Return a standard error in per cent of its value; a question mark if it is not known."""
    return "?" if isnan(sigma) else percentage(100 * sigma / abs(x) if x else float("inf"))


def error_percentage(share: float) -> str:
    """Return a percentage to two digits with its sign, to none from ten on; beyond a thousand it says no more."""
    return f"{share:.2g} %" if share < 10 else f"{share:.0f} %" if share < 1000 else "more than 1000 %"


def printed(show: Callable[[Console], object]) -> str:
    """Text as printed on a console of `PRINTED` characters."""
    file = StringIO()
    show(Console(file=file, width=PRINTED))
    return file.getvalue()
