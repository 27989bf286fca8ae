"""What the reports that are HTML pages share: their style, and figures as SVG."""

from importlib.resources import files
from io import StringIO
from typing import Any

import matplotlib as mpl
from jinja2 import Environment
from matplotlib.figure import Figure

mpl.rcParams.update({"svg.hashsalt": "idbench", "svg.fonttype": "none", "font.size": 8, "axes.grid": True, "grid.alpha": 0.3})


def rendered(package: str, template: str, **words: Any) -> str:
    """Return the page that a template of a package makes of `words`; it needs no other file."""
    page = Environment(autoescape=True, trim_blocks=True).from_string(_text(package, template))
    return page.render(style=_text("idbench.experiments.reports", "report.css"), **words)


def svg(figure: Figure) -> str:
    """Return a figure as SVG, the same bytes for the same figure."""
    text = StringIO()
    figure.savefig(text, format="svg", metadata={"Date": None})
    return text.getvalue()[text.getvalue().index("<svg") :]


def _text(package: str, name: str) -> str:
    return files(package).joinpath(name).read_text(encoding="utf-8")
