"""Charts of one quantity over another, drawn into a 2D view: what rerun plots by itself is over time."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Literal

import numpy as np
import numpy.typing as npt
import rerun as rr

from idbench.experiments.recording.scales import AbstractScale
from idbench.experiments.recording.stream import Stream, part
from idbench.experiments.text import Color
from idbench.identify import Array

HEIGHT = 1.0  # Height of a frame: the unit of everything in a chart. 2D views keep the ratio of their axes
WIDE = 2.2  # Width of the frames of charts one above the other
NARROW = 1.4  # Width of the frames of charts in a row
SQUARE = 1.2  # Width of the frames that hold a long list

FRAME: Color = (120, 120, 120)
GRID: Color = (70, 70, 70)
TEXT: Color = (170, 170, 170)

LINE = 0.11  # Height of a line of the legend
LINES, BESIDE = 11, 0.75  # Lines of the legend, and how far beside them the next ones stand, if there are more
GRID_ORDER = -3.0  # what is drawn over what: of two things the one of higher order
DOT_ORDER = -2.0  # dots over the grid
LINE_ORDER = 1.0  # lines over dots
MARK_ORDER = 2.0  # marks over all

Symbol = Literal["circle", "square", "triangle", "diamond", "cross"]

_TURNS: dict[Symbol, Sequence[tuple[float, float]]] = {
    "square": [(-1, -1), (1, -1), (1, 1), (-1, 1), (-1, -1)],
    "triangle": [(-1, 1), (0, -1), (1, 1), (-1, 1)],
    "diamond": [(-1.3, 0), (0, -1.3), (1.3, 0), (0, 1.3), (-1.3, 0)],
    "cross": [(-1, -1), (1, 1), (0, 0), (-1, 1), (1, -1)],
    "circle": [(np.cos(a), np.sin(a)) for a in np.linspace(0, 2 * np.pi, 13)],
}
SYMBOLS: tuple[Symbol, ...] = tuple(_TURNS)

MAX_ROWS = 13  # Parameters of a chart in rows

LETTER, GAP = 0.5, 1.4  # Width of a letter of a legend in a row, and of the room between its entries, in heights of its view
LETTER_BESIDE = 0.016  # Half the width of a letter beside the upright axis, of a chart that is some 220 points high
RAISE = 0.05  # How far texts are raised: the viewer writes them below where they belong
SIZE = 0.016  # Half the width of a symbol


class Chart:
    """A chart: a frame with its axes, and what is drawn into it.

    Its parts are the children of the entity `path`. Widths and sizes are in points of the screen, which rerun takes from
    negative radii; but that of the frame is in its heights.
    """

    def __init__(self, stream: Stream, path: str, x: AbstractScale, y: AbstractScale, width: float = WIDE) -> None:
        self._stream = stream
        self._path = path
        self._x = x
        self._y = y
        self._listed = list[str]()
        self._width = width
        corners = [[0, 0], [self._width, 0], [self._width, HEIGHT], [0, HEIGHT], [0, 0]]
        self._strips("frame", [np.array(corners)], FRAME, 0.6, GRID_ORDER)
        along, up = self._width * x.at(list(x.ticks)), HEIGHT * (1 - y.at(list(y.ticks)))
        lines = [*([[at, 0], [at, HEIGHT]] for at in along), *([[0, at], [self._width, at]] for at in up)]
        self._strips("grid", [np.array(line) for line in lines], GRID, 0.3, GRID_ORDER)
        self._texts("ticks_x", [(at, HEIGHT + 0.1) for at in along], list(x.ticks.values()))
        beside = [-LETTER_BESIDE * (2 + len(tick)) for tick in y.ticks.values()]
        self._texts("ticks_y", list(zip(beside, up, strict=True)), list(y.ticks.values()))
        self._texts("names", [(self._width / 2, HEIGHT + 0.24), (0.2, -0.09)], [x.name, y.name])

    def dots(self, name: str, x: Array, y: Array, color: Color) -> None:
        """Draw values as dots; those beyond the axes are left out."""
        where = self._where(x, y)[self._x.holds(x) & self._y.holds(y)]
        dots = rr.Points2D(where, colors=[color], radii=[-1.2], show_labels=False, draw_order=DOT_ORDER)
        self._stream.keep(f"{self._path}/dots/{part(name)}", dots)

    def line(self, name: str, x: Array, y: Array, color: Color, width: float = 1.2, *, listed: bool = True) -> None:
        """Draw a line through values, with a gap where one is not finite, and list it in the legend."""
        where = self._where(x, y)
        runs = [run[np.isfinite(run).all(axis=1)] for run in np.split(where, np.flatnonzero(~np.isfinite(where).all(axis=1)))]
        self._strips(f"lines/{part(name)}", [run for run in runs if len(run) > 1], color, width, LINE_ORDER)
        if listed:
            self.list_entry(name, color)

    def intervals(self, name: str, low: Array, high: Array, y: Array, color: Color, width: float) -> None:
        """Draw a level line at each y, from `low` to `high`, arrays of shape (interval,)."""
        ends = np.stack([self._where(low, y), self._where(high, y)], axis=1)
        self._strips(f"segments/{part(name)}", list(ends[np.isfinite(ends).all(axis=(1, 2))]), color, width, LINE_ORDER)

    def marks(self, name: str, x: Array, y: Array, color: Color, symbol: Symbol = "circle") -> None:
        """Draw values as symbols."""
        where, shape = self._where(x, y), SIZE * np.array(_TURNS[symbol])
        strips = [at + shape for at in where[np.isfinite(where).all(axis=1)]]
        self._strips(f"marks/{part(name)}", strips, color, 1.0, MARK_ORDER)

    def write(self, name: str, x: Array, y: Array, texts: Sequence[str], color: Color = TEXT) -> None:
        """Write at values."""
        self._texts(name, self._where(x, y), texts, color)

    def list_entry(self, name: str, color: Color) -> None:
        """Add a line to the legend, which stands beside the frame."""
        aside, down = divmod(len(self._listed), LINES)
        at = (self._width + 0.26 + BESIDE * aside, LINE * (0.5 + down))
        self._listed.append(name)
        self._texts(f"legend/{part(name)}", [at], [name], color)

    def _where(self, x: npt.ArrayLike, y: npt.ArrayLike) -> Array:
        return np.stack([self._width * self._x.at(x), HEIGHT * (1 - self._y.at(y))], axis=-1)  # the view's y points down

    def _strips(self, name: str, strips: Sequence[Array], color: Color, width: float, order: float) -> None:
        lines = rr.LineStrips2D(strips, colors=[color], radii=[-width], draw_order=order, show_labels=False)
        self._stream.keep(f"{self._path}/{name}", lines)

    def _texts(
        self, name: str, where: "Iterable[tuple[float, float]] | Array", texts: Sequence[str], color: Color = TEXT
    ) -> None:
        """Write texts, each in the middle of a line too short to be seen: beside points, they stand below."""
        shown = [(text, np.array([at, at]) - (0, RAISE)) for text, at in zip(texts, where, strict=True) if text]
        words, strips = [text for text, _ in shown], [strip for _, strip in shown]
        lines = rr.LineStrips2D(strips, colors=[color], radii=[0.0], labels=words, show_labels=True)
        self._stream.keep(f"{self._path}/{name}", lines)


def send_keys(stream: Stream, path: str, entries: Mapping[str, Color]) -> None:
    """Send a legend for many plots: names in their colours, in a row."""
    widths = np.array([LETTER * len(name) + GAP for name in entries])
    strips = [np.array([[at, -0.5]] * 2) for at in np.cumsum(widths) - widths / 2]
    lines = rr.LineStrips2D(strips, colors=list(entries.values()), radii=[0.0], labels=list(entries), show_labels=True)
    stream.keep(path, lines)


def in_charts(names: Sequence[str], most: int) -> Iterator[tuple[str, npt.NDArray[np.intp]]]:
    """Yield the name of each chart of `most` parameters, and their places."""
    for k, members in enumerate(np.array_split(np.arange(len(names)), -(-len(names) // most))):
        yield f"{k}_{part(names[members[0]])}_to_{part(names[members[-1]])}", members
