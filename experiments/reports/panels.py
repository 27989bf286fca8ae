"""Curves as SVG that stands in a page: panels with axes, lines and dots, drawn without another package."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from html import escape

import numpy as np

from idbench.experiments.text import decade_values, round_values
from idbench.identify import Array
from idbench.identify.arrays import TINY

WIDTH = 520.0  # Of a panel [px]: two beside each other on a page, one on a telephone
ROW = 96.0  # An inch of a panel's height [px]
LEFT = 46.0  # Room beside a panel for numbers [px]
RIGHT = 8.0  # Room at their other end [px]
TOP = 20.0  # Room for the title [px]
BOTTOM = 20.0  # Room for numbers below a panel [px]
ABOVE = 30.0  # What an inch of a panel's height has for title and numbers [px]

FINE = 2
"""Columns of curves for a pixel of a panel, so that a browser can enlarge them: each has its least and its largest sample."""


@dataclass
class PanelAxis:
    """One direction of a panel."""

    log: bool = False
    """Whether it is logarithmic."""
    limits: tuple[float, float] | None = None
    """Its ends; those of the data by default."""

    def scaled(self, x: Array) -> Array:
        """Places of values on an even axis."""
        return np.log10(np.maximum(x, TINY)) if self.log else np.asarray(x, dtype=np.float64)

    def ends(self, every: Sequence[Array]) -> tuple[float, float]:
        """Return its ends, for data."""
        if self.limits is not None:
            return self.limits
        values = np.concatenate([*(x[np.isfinite(x) & ((x > 0) | (not self.log))] for x in every), np.empty(0)])
        if not len(values):
            return (0.1, 1.0) if self.log else (0.0, 1.0)
        low, high = float(values.min()), float(values.max())
        room = 0.04 * (high - low) or 0.1 * abs(high) or 1.0
        return (low, high) if self.log else (low - room, high + room)

    def numbers(self, low: float, high: float) -> dict[float, str]:
        """Round numbers on it, and their texts."""
        values = decade_values(low, high) if self.log else round_values(low, high)
        return {x: f"{x:g}" for x in values.tolist()}


@dataclass
class Panel:
    """A pair of axes, and what is drawn between them."""

    title: str = ""
    """Above it."""
    x: PanelAxis = field(default_factory=PanelAxis)
    """From left to right."""
    y: PanelAxis = field(default_factory=PanelAxis)
    """Upwards."""
    drawn: list[tuple[str, Array, Array, str, float, str]] = field(default_factory=list)
    """Kind, x, y, color, size and label of what is drawn."""

    def line(self, x: Array, y: Array, color: str, width: float = 1.0, label: str = "", dash: str = "") -> None:
        """Draw a curve, interrupted where it is NaN."""
        self.drawn.append((f"line {dash}", x, y, color, width, label))

    def dots(self, x: Array, y: Array, color: str, radius: float = 1.5, label: str = "") -> None:
        """Draw dots."""
        self.drawn.append(("dots", x, y, color, radius, label))


def figure(panels: Sequence[Panel], height: float, x: str = "", y: str = "") -> str:
    """Return panels of a height [inch] as SVG, one picture each: a page puts as many beside each other as it is wide."""
    size, drawn = _all(panels, height, WIDTH)
    head = f'<svg class="curves" xmlns="{SVG}" viewBox="0 0 {size[0]:.0f} {size[1]:.0f}" font-size="11">'
    each = [f"{head}{one}</svg>" for one in drawn]
    words = [f"<span>{escape(_axes(x, y))}</span>"]
    for kind, color, label in _labels(panels):
        shape = "line dashed" if len(kind.split()) > 1 else kind.strip()
        words.append(f'<span><i class="{shape}" style="background:{color}"></i>{escape(label)}</span>')
    return "\n".join([f'<div class="legend">{" ".join(words)}</div><div class="panels">', *each, "</div>"])


def stacked(panels: Sequence[Panel], height: float, x: str = "", y: str = "") -> str:
    """Return panels below each other as one SVG, for a file of its own; parameters as of `figure`."""
    size, drawn = _all(panels, height, 2 * WIDTH)
    whole = HEAD + len(panels) * size[1]
    parts = [f'<svg xmlns="{SVG}" viewBox="0 0 {size[0]:.0f} {whole:.0f}" font-size="11" font-family="sans-serif">']
    parts.append(_text(LEFT, 13, _axes(x, y)))
    at = size[0]
    for kind, color, label in reversed(_labels(panels)):
        at -= 6.5 * len(label) + 30
        width, length = (5, 0) if kind == "dots" else (2, 14)
        parts.append(f'<path d="M{at:.0f},9h{length}" stroke="{color}" stroke-width="{width}" stroke-linecap="round"/>')
        parts.append(_text(at + 20, 13, label))
    parts += [f'<g transform="translate(0 {HEAD + k * size[1]:.0f})">{one}</g>' for k, one in enumerate(drawn)]
    return "\n".join([*parts, "</svg>"])


def _all(panels: Sequence[Panel], height: float, wide: float) -> tuple[tuple[float, float], list[str]]:
    """Return the size of each panel [px], and their elements."""
    inner = wide - LEFT - RIGHT, height * ROW - ABOVE
    return (wide, TOP + inner[1] + BOTTOM), ["\n".join(_panel(panel, *inner)) for panel in panels]


def _axes(x: str, y: str) -> str:
    return f"{y} over {x}" if x and y else x or y


def _labels(panels: Sequence[Panel]) -> list[tuple[str, str, str]]:
    """Return kind, color and label of what the first panel shows."""
    return [(kind, color, label) for kind, _, _, color, _, label in (panels[0].drawn if panels else ()) if label]


HEAD = 20.0  # Room for the legend of a picture [px]

SVG = "http://www.w3.org/2000/svg"


def _text(x: float, y: float, text: str, anchor: str = "start") -> str:
    return f'<text x="{x:.0f}" y="{y:.0f}" text-anchor="{anchor}">{escape(text)}</text>' if text else ""


def _panel(panel: Panel, wide: float, high: float) -> Iterator[str]:
    """Yield the elements of a panel, its inner size given [px]."""
    low_x, high_x = panel.x.ends([x for _, x, *_ in panel.drawn])
    low_y, high_y = panel.y.ends([y for _, _, y, *_ in panel.drawn])
    begin_x, end_x = panel.x.scaled(np.array([low_x, high_x]))
    begin_y, end_y = panel.y.scaled(np.array([low_y, high_y]))

    def place_x(x: Array) -> Array:
        return np.asarray(LEFT + wide * (panel.x.scaled(x) - begin_x) / ((end_x - begin_x) or 1.0))

    def place_y(y: Array) -> Array:
        share = (panel.y.scaled(y) - begin_y) / ((end_y - begin_y) or 1.0)
        return np.clip(TOP + high * (1 - share), TOP - high, TOP + 2 * high)

    box = f'width="{wide:.0f}" height="{high:.0f}"'
    yield f'<svg x="{LEFT:.0f}" y="{TOP:.0f}" {box} viewBox="{LEFT:.0f} {TOP:.0f} {wide:.0f} {high:.0f}">'
    for value in panel.y.numbers(low_y, high_y):
        level = float(place_y(np.array([value]))[0])
        yield f'<path d="M{LEFT:.0f},{level:.1f}h{wide:.0f}" stroke="#e4e4e4"/>'
    for kind, x, y, color, width, _ in panel.drawn:
        yield from _drawn(kind, place_x(x), place_y(y), color, width, int(wide) * FINE)
    yield "</svg>"
    yield f'<rect x="{LEFT:.0f}" y="{TOP:.0f}" {box} fill="none" stroke="#888"/>'
    yield _text(LEFT, TOP - 5, panel.title)
    for value, text in panel.y.numbers(low_y, high_y).items():
        yield _text(LEFT - 4, float(place_y(np.array([value]))[0]) + 3, text, "end")
    for value, text in panel.x.numbers(low_x, high_x).items():
        yield _text(float(place_x(np.array([value]))[0]), TOP + high + 13, text, "middle")


def _drawn(kind: str, x: Array, y: Array, color: str, width: float, columns: int) -> Iterator[str]:
    """Yield the elements of what is drawn, at places [px]."""
    if kind == "dots":
        every = len(x) // columns + 1 if len(x) > columns else 1  # more dots than that are a cloud, whatever they are
        shown = np.stack([x, y], axis=1)[::every]
        points = "".join(f"M{a:.1f},{b:.1f}h0" for a, b in shown[np.isfinite(shown).all(axis=1)].tolist())
        yield f'<path d="{points}" stroke="{color}" stroke-width="{2 * width:g}" stroke-linecap="round"/>' if points else ""
        return
    places = np.stack(_thinned(x, y, columns), axis=1)
    runs = np.split(places, np.flatnonzero(np.diff(np.isfinite(places).all(axis=1).astype(int)) != 0) + 1)
    there = [run for run in runs if np.isfinite(run).all() and len(run)]
    path = "".join("M" + " ".join(f"{p:.1f},{q:.1f}" for p, q in run.tolist()) for run in there)
    dash = kind.removeprefix("line ").strip()
    dashed = f' stroke-dasharray="{dash}"' if dash else ""
    yield f'<path d="{path}" fill="none" stroke="{color}" stroke-width="{width:g}"{dashed}/>' if path else ""


def _thinned(x: Array, y: Array, columns: int) -> tuple[Array, Array]:
    """Return a curve with the least and the largest value of each column, in their order."""
    every = len(x) // columns
    if every < 3:
        return x, y
    count = len(x) // every
    shaped = y[: count * every].reshape(count, every)
    gone = ~np.isfinite(shaped)
    low, high = np.where(gone, np.inf, shaped).argmin(axis=1), np.where(gone, -np.inf, shaped).argmax(axis=1)
    kept = np.unique(np.stack([low, high], axis=1) + every * np.arange(count)[:, None])
    return x[kept], y[kept]
