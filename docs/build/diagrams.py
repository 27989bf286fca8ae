"""Draw the diagrams of the pages: boxes on a grid, and arrows between them.

    uv run python docs/build/diagrams.py

Boxes are light with dark letters, arrows are grey: they can be read on a light and on a dark page.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from html import escape
from pathlib import Path

DOCS = Path(__file__).absolute().parent.parent

WIDTH, HEIGHT, GAP_X, GAP_Y = 168, 52, 48, 30
"""Sizes of a box, and the gaps between boxes [px]."""

QUESTION, ANSWER, STEP, DATA = "#fff3d6", "#d9f2e1", "#dbe8fb", "#eeeeee"


@dataclass(frozen=True)
class Box:
    """A box: column and row on the grid, lines of text, and its colour."""

    x: float
    y: float
    text: str
    colour: str = STEP

    @property
    def left(self) -> float:
        """Its left edge [px]."""
        return 12 + self.x * (WIDTH + GAP_X)

    @property
    def top(self) -> float:
        """Its upper edge [px]."""
        return 12 + self.y * (HEIGHT + GAP_Y)


@dataclass(frozen=True)
class Diagram:
    """Boxes by name, and arrows: from, to, and what is written beside it."""

    boxes: dict[str, Box]
    arrows: tuple[tuple[str, str, str], ...]

    def svg(self) -> str:
        """Return it as SVG."""
        right = max(box.left for box in self.boxes.values()) + WIDTH + 12
        bottom = max(box.top for box in self.boxes.values()) + HEIGHT + 12
        size = f'viewBox="0 0 {right:g} {bottom:g}" width="{right:g}"'
        head = f'<svg xmlns="http://www.w3.org/2000/svg" {size} font-family="sans-serif" font-size="13">'
        tip = '<marker id="tip" viewBox="0 0 8 8" refX="7" refY="4" markerWidth="7" markerHeight="7" orient="auto">'
        tip += '<path d="M0 0L8 4L0 8z" fill="#888"/></marker>'
        return "\n".join([head, f"<defs>{tip}</defs>", *self._arrows(), *self._boxes(), "</svg>", ""])

    def _arrows(self) -> Iterator[str]:
        for start, end, label in self.arrows:
            a, b = self.boxes[start], self.boxes[end]
            sideways = a.x != b.x
            if sideways:
                x1, y1, x2, y2 = a.left + WIDTH, a.top + HEIGHT / 2, b.left, b.top + HEIGHT / 2
            else:
                down = b.y > a.y
                x1 = x2 = a.left + WIDTH / 2
                y1, y2 = (a.top + HEIGHT, b.top) if down else (a.top, b.top + HEIGHT)
            yield f'<path d="M{x1:g} {y1:g}L{x2:g} {y2:g}" stroke="#888" stroke-width="1.6" marker-end="url(#tip)"/>'
            if label:
                x, y = (x1 + x2) / 2 + (0 if sideways else 16), (y1 + y2) / 2 + (-6 if sideways else 4)
                place = f'x="{x:g}" y="{y:g}"'
                yield f'<text {place} fill="#888" text-anchor="middle">{escape(label)}</text>'

    def _boxes(self) -> Iterator[str]:
        for box in self.boxes.values():
            size = f'x="{box.left:g}" y="{box.top:g}" width="{WIDTH}" height="{HEIGHT}"'
            yield f'<rect {size} rx="7" fill="{box.colour}" stroke="#888"/>'
            lines = box.text.split("\n")
            for number, line in enumerate(lines):
                y = box.top + HEIGHT / 2 + 5 + 17 * (number - (len(lines) - 1) / 2)
                place = f'x="{box.left + WIDTH / 2:g}" y="{y:g}"'
                yield f'<text {place} fill="#222" text-anchor="middle">{escape(line)}</text>'


ESTIMATOR = Diagram(
    {
        "filtered": Box(0, 0, "Torques and positions\nunfiltered?", QUESTION),
        "outliers": Box(0, 1, "Outliers?", QUESTION),
        "coarse": Box(0, 2, "12 bits or fewer, and\nno filter possible?", QUESTION),
        "loop": Box(0, 3, "Controller exactly\nknown?", QUESTION),
        "ML": Box(1, 0, "ML\nreaches the bound", ANSWER),
        "IRLS": Box(1, 1, "IRLS\nremoves them", ANSWER),
        "GLS": Box(1, 2, "GLS\nthe default", ANSWER),
        "DIDIM": Box(1, 3, "DIDIM", ANSWER),
        "IV": Box(0, 4, "IV\nthe loop may be wrong", ANSWER),
    },
    (
        ("filtered", "ML", "yes"),
        ("filtered", "outliers", "no"),
        ("outliers", "IRLS", "yes"),
        ("outliers", "coarse", "no"),
        ("coarse", "GLS", "no"),
        ("coarse", "loop", "yes"),
        ("loop", "DIDIM", "yes"),
        ("loop", "IV", "no"),
    ),
)

CHAIN = Diagram(
    {
        "log": Box(0, 0.5, "log\nq, tau", DATA),
        "prefilter": Box(1, 0, "prefilter"),
        "differentiator": Box(2, 0, "differentiator\nqd, qdd"),
        "alignment": Box(1, 1, "alignment\ntau at the time of q"),
        "mask": Box(2, 1, "mask\nreversals, rests"),
        "model": Box(3, 0, "model\nB tau = (c + s e) X"),
        "operator": Box(3, 1, "operator\ns, low-pass, decimation"),
        "rows": Box(4, 1, "rows\nY = W X + rho", DATA),
        "estimator": Box(4, 0, "estimator"),
        "X": Box(5, 0, "X, standard errors", ANSWER),
    },
    (
        ("log", "prefilter", ""),
        ("log", "alignment", ""),
        ("prefilter", "differentiator", ""),
        ("differentiator", "model", ""),
        ("differentiator", "mask", ""),
        ("alignment", "mask", ""),
        ("model", "operator", ""),
        ("mask", "operator", ""),
        ("operator", "rows", ""),
        ("rows", "estimator", ""),
        ("estimator", "X", ""),
    ),
)

LAYERS = Diagram(
    {
        "file": Box(0, 0, "robot file\nMJCF, URDF, DH table", DATA),
        "scenario": Box(0, 1, "scenario.toml", DATA),
        "real": Box(0, 2, "log of a real robot\nCSV, Parquet, ROS bag", DATA),
        "sim": Box(1, 1, "sim\nMuJoCo, drives, encoders"),
        "log": Box(2, 2, "MotionLog\nt, q, tau", DATA),
        "identify": Box(3, 2, "identify\nno simulator, no viewer"),
        "experiments": Box(4, 1, "experiments\nverdict, studies, reports"),
        "rerun": Box(5, 1, "rerun recording\nreport.html", ANSWER),
        "written": Box(5, 2, "MJCF, URDF, function\nfor a controller", ANSWER),
    },
    (
        ("file", "sim", ""),
        ("scenario", "sim", ""),
        ("sim", "log", ""),
        ("real", "log", ""),
        ("log", "identify", ""),
        ("identify", "experiments", ""),
        ("sim", "experiments", ""),
        ("experiments", "rerun", ""),
        ("experiments", "written", ""),
    ),
)

DIAGRAMS = {"which-estimator": ESTIMATOR, "chain": CHAIN, "architecture": LAYERS}

if __name__ == "__main__":
    for name, diagram in DIAGRAMS.items():
        (DOCS / f"{name}.svg").write_text(diagram.svg())
