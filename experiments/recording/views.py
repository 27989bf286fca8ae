"""Views that layouts are made of: of the entities that a recording has, none where it has none."""

from collections.abc import Iterable, Sequence
from collections.abc import Set as AbstractSet

import rerun.blueprint as rrb

from idbench.experiments.recording.chart import HEIGHT, WIDE
from idbench.experiments.recording.stream import SIZES

LEGEND, EDGE = 0.66, 0.1  # Room to the right of a chart, with a legend and without one, in heights of its frame
KEYS = rrb.VisualBounds2D(x_range=[0, 42], y_range=[-0.5, 0.5])  # What a row of keys shows: some eight of them
ACROSS = 2  # Legends beside each other

Part = rrb.Container | rrb.View | None


class Shelf:
    """The entities of a recording, of which `paths` are all, by what they are."""

    def __init__(self, paths: AbstractSet[str]) -> None:
        named = [path.strip("/") for path in paths]
        stripped = [path for path in named if not path.startswith(f"{SIZES}/")]
        self.sizes = {path: size.split("_") for _, size, path in (name.split("/", 2) for name in set(named) - set(stripped))}
        self.joints = [joint for _, joint in sorted(path.split("/")[1:] for path in stripped if path.startswith("joints/"))]
        rank = {joint: f"{number:03}" for number, joint in enumerate(self.joints)}  # joints by their order in the robot
        self.paths = sorted(stripped, key=lambda path: [rank.get(part, part) for part in path.split("/")])
        self._ending: dict[tuple[int, str], list[tuple[str, list[str]]]] = {}
        for path in self.paths:  # an arm of seven joints has thousands of paths, and layouts ask a thousand times
            parts = path.split("/")
            for end in (parts[-1], "*"):
                self._ending.setdefault((len(parts), end), []).append((path, parts))

    def of(self, *patterns: str) -> list[str]:
        """Return the entities that match one of the patterns, in which * stands for one part of a path."""
        found = list[str]()
        for pattern in (pattern.split("/") for pattern in patterns):
            fixed = [(at, part) for at, part in enumerate(pattern[:-1]) if part != "*"]
            same = self._ending.get((len(pattern), pattern[-1]), [])
            found += [path for path, parts in same if all(parts[at] == part for at, part in fixed)]
        return found

    def largest(self, paths: Iterable[str]) -> float:
        """Largest size of curves; 0 if none is known."""
        return max((float(size) for path in paths for size in self.sizes.get(path, ())), default=0.0)

    def rms(self, paths: Iterable[str]) -> str:
        """Size of curves for a title: the viewer's axes may have no number but 0."""
        if not (known := [size for path in paths for size in self.sizes.get(path, ())]):
            return ""
        low, high = min(known, key=float), max(known, key=float)
        return f", rms {high}" if low == high else f", largest rms {high}"

    def parts(self, pattern: str, number: int = -1) -> list[str]:
        """Parts of this number, the last by default, of the paths of the matching entities, each once."""
        return list(dict.fromkeys(path.split("/")[number] for path in self.of(pattern)))

    @property
    def methods(self) -> list[str]:
        """Identifications, as they are called."""
        return self.parts("identify/*/report", 1)


def plot(shelf: Shelf, name: str, *patterns: str, legend: bool = False) -> Part:
    """Return a view of curves over time, its time axis that of all others; none if there is nothing to show.

    A legend, in which curves can be switched off and on, covers some of them: `keys` is one for all views.
    """
    if not (found := shelf.of(*patterns)):
        return None
    name += shelf.rms(found)
    linked = rrb.TimeAxis(link=rrb.components.LinkAxis.LinkToGlobal)
    return rrb.TimeSeriesView(name=name, contents=_contents(found), axis_x=linked, plot_legend=rrb.PlotLegend(visible=legend))


def window(shelf: Shelf, name: str, *patterns: str) -> Part:
    """Return a view of curves over a time axis of its own: what lies inside the loop is short."""
    found = shelf.of(*patterns)
    hidden = rrb.PlotLegend(visible=False)
    return rrb.TimeSeriesView(name=name, contents=_contents(found), plot_legend=hidden) if found else None


def lanes(shelf: Shelf, name: str, *patterns: str) -> Part:
    """Return a view of states over time, if there are any."""
    found = shelf.of(*patterns)
    return rrb.StateTimelineView(name=name, contents=_contents(found)) if found else None


def charts(shelf: Shelf, name: str, pattern: str, width: float = WIDE, words: float = 0.0) -> list[Part]:
    """Return a view of each chart, its frame of a `width`, titled with parts of its path: {1} for the second one and so on.

    `words` is the room that names beside the upright axis need more than numbers do, in heights of the frame.
    """
    views = list[Part]()
    for path in (frame.removesuffix("/frame") for frame in shelf.of(f"{pattern}/frame")):
        right = LEGEND if shelf.of(f"{path}/legend/*") else EDGE
        bounds = rrb.VisualBounds2D(x_range=[-0.32 - words, width + right], y_range=[-0.17, HEIGHT + 0.36])
        views.append(rrb.Spatial2DView(origin=f"/{path}", name=name.format(*path.split("/")), visual_bounds=bounds))
    return views


def keys(shelf: Shelf, *patterns: str) -> Part:
    """Return legends, side by side in a row that is as low as it can be."""
    rows = [rrb.Spatial2DView(origin=f"/{path}", name=path, titlebar=False, visual_bounds=KEYS) for path in shelf.of(*patterns)]
    return rrb.Grid(*rows, grid_columns=ACROSS) if len(rows) > 1 else next(iter(rows), None)


def text(shelf: Shelf, *patterns: str) -> Part:
    """Return the texts, one behind the other, if there are any."""
    found = [
        rrb.TextDocumentView(origin=f"/{path}", name=path.split("/")[1] if "/" in path else path)
        for path in shelf.of(*patterns)
    ]
    return rrb.Tabs(*found, active_tab=len(found) - 1, name="texts") if len(found) > 1 else next(iter(found), None)


def arm(shelf: Shelf) -> Part:
    """Return the arm, if it is drawn."""
    return rrb.Spatial3DView(origin="/world", name="arm") if "world" in shelf.paths else None


def _contents(paths: Iterable[str]) -> list[str]:
    return [f"+ /{path}" for path in paths]


def column(*parts: Part, shares: Sequence[float] | None = None, name: str | None = None) -> Part:
    """Return the parts that there are, one above the other; none if there are none."""
    there = [(part, share) for part, share in zip(parts, shares or [1.0] * len(parts), strict=True) if part is not None]
    return rrb.Vertical(*(p for p, _ in there), row_shares=[s for _, s in there], name=name) if there else None


def side_by_side(name: str, *parts: Part, shares: Sequence[float]) -> Part:
    """Return the parts that there are, side by side, under a name; none if there are none."""
    if not (there := [(part, share) for part, share in zip(parts, shares, strict=True) if part is not None]):
        return None
    return rrb.Horizontal(*(p for p, _ in there), column_shares=[s for _, s in there], name=name)


def tabbed(parts: Sequence[Part], name: str | None = None) -> Part:
    """Return parts behind each other, the first in front."""
    there = [part for part in parts if part is not None]
    return rrb.Tabs(*there, active_tab=0, name=name) if there else None


def grid(name: str, parts: Sequence[Part], columns: int) -> Part:
    """Return the parts that there are in a grid."""
    there = [part for part in parts if part is not None]
    return rrb.Grid(*there, grid_columns=columns, name=name) if there else None
