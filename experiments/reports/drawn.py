"""Figures of Matplotlib in pages."""

from io import StringIO

import matplotlib as mpl
from matplotlib.figure import Figure

mpl.rcParams.update({"svg.hashsalt": "idbench", "svg.fonttype": "none", "font.size": 8, "axes.grid": True, "grid.alpha": 0.3})


def svg(figure: Figure) -> str:
    """Return a figure as SVG, the same bytes for the same figure."""
    text = StringIO()
    figure.savefig(text, format="svg", metadata={"Date": None})
    return text.getvalue()[text.getvalue().index("<svg") :]
