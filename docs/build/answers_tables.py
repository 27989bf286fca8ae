"""Tables and pictures of added rows of power, of ruckig's moves, of the smallest imperfections, and of the implicit column."""

import json
from collections.abc import Callable, Iterator, Sequence
from math import log2
from pathlib import Path
from typing import Any

from results import RESULTS, Cell, cells, table, typical

from idbench.experiments.paper.table1 import PAPER

NOISES = {
    "none": "none",
    "torque": "white torque noise",
    "encoder": "14-bit encoder",
    "ripple": "ripple, 16 bits",
    "all": "all of them",
    "friction": "Stribeck friction",
}
MOVES = {"fifth-order": "fifth-order", "ruckig": "ruckig", "ruckig-fastest": "ruckig, fastest"}
WAYS = ("idbench", "GLS", "explicit"), ("idbench", "GLS", "power"), ("paper_masked", "OLS", "explicit")
PACES = {"slow": "2.6 s", "usual": "1.3 s", "fast": "0.8 s"}
CHAINS = {"paper": ("#b5651d", "the paper's steps"), "paper_masked": ("#2f6f9f", "the same, reversals left out")}
COLORS = {"explicit": "#2ca02c", "power": "#d62728"}
SMALLEST = {
    "smallest-ripple": ("ripple.cogging", "cogging, times the robot's"),
    "smallest-count": ("encoder.lines", "encoder"),
    "smallest-delay": ("delay", "delay that nobody states"),
}


def _by(study: str, *keys: str) -> dict[tuple[Any, ...], Cell]:
    """Return cells by some of their settings, then chain, estimator and model."""
    return {(*(c["settings"][key] for key in keys), c["chain"], c["estimator"], c["model"]): c for c in cells(study)}


def _firsts(found: dict[tuple[Any, ...], Cell], place: int) -> list[Any]:
    return list(dict.fromkeys(key[place] for key in found))


def explicit_power() -> Iterator[str]:
    """Yield typical errors [%] of the explicit model, without rows of power beside it and with them."""
    found = _by("explicit-power", "noise")
    estimators = _firsts(found, 2)

    def rows() -> Iterator[Sequence[str]]:
        for noise in _firsts(found, 0):
            for chain in _firsts(found, 1):
                pairs = ((found[noise, chain, e, m] for m in ("explicit", "explicit+power")) for e in estimators)
                yield [NOISES[noise], chain, *(" → ".join(map(typical, pair)) for pair in pairs)]

    yield from table(["noise", "chain", *estimators], rows())


def _value(x: Any, key: str) -> str:
    return f"{log2(4 * x):g} bits" if key == "encoder.lines" else x if isinstance(x, str) else f"{x:g}"


def _two(x: float) -> str:
    return f"{x:.0f}" if x >= 10 else f"{x:#.2g}"


def implicit_steps() -> Iterator[str]:
    """Yield what changes of one step of the chain make of the implicit model's errors over the explicit one's."""
    found = json.loads((RESULTS / "implicit-steps.json").read_text())
    rows = (
        [
            row["step"],
            f"{_two(row['ratio'])} ({_two(row['low'])} to {_two(row['high'])})",
            f"{100 * row['reached']:.0f} %",
            f"{100 * row['all_larger']:.0f} %",
            _two(row["over_paper"]),
        ]
        for row in found
        if not row["step"].endswith(", paper")
    )
    yield from table(["changed", "implicit / explicit", "2.7 or more", "all eight larger", "implicit / the paper's"], rows)


def table1_motions() -> Iterator[str]:
    """Yield the paper's errors [%] of two models, and medians of random motions in two chains."""
    found = json.loads((RESULTS / "table1-motions.json").read_text())

    def rows() -> Iterator[Sequence[str]]:
        for model in ("explicit", "power"):
            paper = found["paper_percent"][model]
            yield [f"the paper, {model}", *(f"{x:.3f}" for x in paper), f"{PAPER[model].condition_number:g}", "", ""]
            for chain, of in found["chains"].items():
                own = of["models"][model]
                inside = sum(sum(each["explained"]) for each in of["models"].values())
                total = len(paper) * len(of["models"])
                counts = (f"{of['kept']}", f"{inside} of {total}") if model == "explicit" else ("", "")
                cond = f"{own['median_condition_number']:.0f}"
                yield [f"chain `{chain}`, {model}", *(f"{x:.2g}" for x in own["median_percent"]), cond, *counts]

    yield from table(["", *found["parameters"], "Cond(W)", "motions kept", "inside"], rows())


def _panels(titles: Sequence[str], height: float) -> Sequence[Any]:
    """Return panels beside each other with logarithmic axes of errors."""
    from matplotlib.figure import Figure

    import idbench.experiments.reports.drawn  # noqa: F401  # letters as in reports

    panels = Figure(figsize=(11, height), layout="constrained").subplots(1, len(titles), sharey=True)
    for panel, title in zip(panels, titles, strict=True):
        panel.set_yscale("log")
        panel.set_title(title, loc="left", fontsize=11)
        panel.grid(axis="y", color="0.9")
        panel.spines[["top", "right"]].set_visible(False)
    return panels


def _saved(panels: Sequence[Any], what: str, place: Path) -> None:
    panels[0].set_ylabel(what)
    figure = panels[0].figure
    figure.legend(*panels[0].get_legend_handles_labels(), loc="outside lower center", ncols=3, frameon=False, fontsize=9)
    figure.savefig(place, dpi=110)


def draw_smallest(place: Path) -> None:
    """Draw typical errors over ripple, counts and delay, of two models and three paces."""
    panels = _panels([head for _, head in SMALLEST.values()], 3.8)
    for panel, (study, (key, _)) in zip(panels, SMALLEST.items(), strict=True):
        found = _by(study, key, "pace")
        values = _firsts(found, 0)
        for model, color in COLORS.items():
            for pace, style in zip(PACES, (":", "-", "--"), strict=True):
                y = [float(typical(found[x, pace, "idbench", "GLS", model])) for x in values]
                panel.plot(y, style, color=color, marker="o", markersize=3, label=f"{model}, moves of {PACES[pace]}")
        panel.set_xticks(range(len(values)), [_value(x, key) for x in values], rotation=30)
    _saved(panels, "typical error [%]", place)


def draw_moves(place: Path) -> None:
    """Draw typical errors of fifth-order moves and of ruckig's, by imperfection."""
    found = _by("moves", "noise", "moves")
    noises = _firsts(found, 0)
    panels = _panels([f"{model} model, chain {chain}, {estimator}" for chain, estimator, model in WAYS], 3.8)
    for panel, way in zip(panels, WAYS, strict=True):
        for k, (motion, name) in enumerate(MOVES.items()):
            y = [float(typical(found[noise, motion, *way])) for noise in noises]
            panel.plot([i + 0.15 * (k - 1) for i in range(len(noises))], y, "osD"[k], label=name)
        panel.set_xticks(range(len(noises)), [NOISES[noise] for noise in noises], rotation=25, ha="right")
    _saved(panels, "typical error [%]", place)


def draw_motions(place: Path) -> None:
    """Draw the medians and bands of Table 1's errors over random motions beside the paper's."""
    found = json.loads((RESULTS / "table1-motions.json").read_text())
    names, paper = found["parameters"], found["paper_percent"]
    panels = _panels([f"{model} model" for model in paper], 4.6)
    for panel, model in zip(panels, paper, strict=True):
        for k, (chain, (color, label)) in enumerate(CHAINS.items()):
            of, x = found["chains"][chain]["models"][model], [i + 0.24 * (k - 0.5) for i in range(len(names))]
            panel.vlines(x, of["low_percent"], of["high_percent"], color=color, linewidth=5, alpha=0.45)
            panel.plot(x, of["median_percent"], "o", color=color, markersize=4, label=label)
        panel.plot(paper[model], "kx", markersize=7, markeredgewidth=1.8, label="the paper")
        panel.set_ylim(5e-4, 50)
        panel.set_xticks(range(len(names)), names)
    _saved(panels, "error [%]: median, and 5 to 95 % of the motions", place)


ANSWERS_TABLES: dict[str, Callable[[], Iterator[str]]] = {
    "explicit-power": explicit_power,
    "implicit-steps": implicit_steps,
    "table1-motions": table1_motions,
}
