"""The tables and the picture of the paper's conclusion, from the results of the studies of models."""

import json
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

from results import DOCS, RESULTS, table

from idbench.experiments.study.ratios import PAIRS, interval

SHIPPED = DOCS.parent / "experiments" / "paper" / "conclusion.json"
"""The ratios that `idbench table1` and `table2` state."""

NOISES = {"torque": "white torque noise", "encoder": "14-bit encoder", "ripple": "ripple, 16 bits", "all": "all of them"}
ROBOTS = {"models-puma560": "PUMA 560, six joints", "models-panda": "Panda, seven joints"}
DIGITS = 4

Ratio = dict[str, Any]


def keep_ratios(folder: Path) -> None:
    """Keep the ratios of the studies of models whose results a folder has."""
    for path in sorted(folder.glob("models*/summary.json")):
        summary = json.loads(path.read_text())
        rows = []
        for row in summary["ratios"]:
            numbers = {key: float(f"{row[key]:.{DIGITS}g}") for key in ("ratio", "low", "high")}
            settings = {"noise": row["settings"]["noise"]}
            rows.append(
                {"settings": settings, **{key: row[key] for key in ("chain", "estimator", "models", "runs")}, **numbers}
            )
        name = path.parent.name
        place = SHIPPED if name == "models" else RESULTS / f"{name}-ratios.json"
        lines = ",\n".join(json.dumps(row) for row in rows)
        place.write_text(f'{{"study": "{name}", "seeds": {summary["study"]["seeds"]}, "ratios": [\n{lines}\n]}}\n')


def ratios(study: str) -> list[Ratio]:
    """Return the ratios that are kept of a study."""
    place = SHIPPED if study == "models" else RESULTS / f"{study}-ratios.json"
    found: list[Ratio] = json.loads(place.read_text())["ratios"]
    return found


def _cell(row: Ratio | None) -> str:
    return "" if row is None else interval(row)


SHOWN = ("OLS", "GLS"), PAIRS[:2]  # Estimators and ratios of the tables; the command prints all


def _of_models(study: str, chains: Sequence[str], first: str = "noise") -> Iterator[str]:
    """Yield ratios with their intervals, a row for each noise, chain and estimator."""
    shown = (r for r in ratios(study) if r["chain"] in chains and r["estimator"] in SHOWN[0])
    found = {(r["settings"]["noise"], r["chain"], r["estimator"], *r["models"]): r for r in shown}

    def rows() -> Iterator[Sequence[str]]:
        for noise, chain, estimator in dict.fromkeys(key[:3] for key in found):
            yield [
                NOISES[noise],
                chain,
                estimator,
                *(_cell(found.get((noise, chain, estimator, *pair))) for pair in SHOWN[1]),
            ]

    yield from table([first, "chain", "estimator", *(f"{a} / {b}" for a, b in SHOWN[1])], rows())


def _many_joints() -> Iterator[str]:
    for study, robot in ROBOTS.items():
        yield from _of_models(study, ("idbench",), robot)


def _operations() -> Iterator[str]:
    from idbench.experiments.identification.robot_model import RobotModel
    from idbench.identify.basis.operations import COLUMNS, operations

    def rows() -> Iterator[Sequence[str]]:
        for robot in ("scara", "puma560", "panda"):
            counts = [operations(RobotModel(robot).basis, model) for model in COLUMNS]
            shares = [f"{c.multiplications} / {c.additions} / {c.derivatives}" for c in counts]
            yield [robot, *shares, *(f"{c.total / counts[0].total:.2f}" for c in counts[1:])]

    names = [f"{model} x / + / s" for model in COLUMNS]
    yield from table(["", *names, "implicit / explicit", "power / explicit"], rows())


CONCLUSION_TABLES: dict[str, Callable[[], Iterator[str]]] = {
    "models": lambda: _of_models("models", ("idbench", "paper")),
    "models-joints": _many_joints,
    "operations": _operations,
}


def picture(place: Path) -> None:
    """Draw the errors of the implicit and the power model over the explicit model's, for four noises."""
    from matplotlib.figure import Figure

    import idbench.experiments.reports.drawn  # noqa: F401  # letters as in reports, whatever was drawn before

    figure = Figure(figsize=(9, 3.6), layout="constrained")
    axes = figure.subplots()
    styles = {
        ("implicit", "OLS"): ("#9467bd", "s", "implicit, least squares"),
        ("implicit", "GLS"): ("#9467bd", "o", "implicit, generalized least squares"),
        ("power", "OLS"): ("#d62728", "s", "power, least squares"),
        ("power", "GLS"): ("#d62728", "o", "power, generalized least squares"),
    }
    found = {(r["settings"]["noise"], r["models"][0], r["estimator"]): r for r in ratios("models")
             if r["chain"] == "idbench" and r["models"][1] == "explicit"}  # fmt: skip
    for k, ((model, estimator), (color, marker, label)) in enumerate(styles.items()):
        rows = [found[noise, model, estimator] for noise in NOISES]
        x = [i + 0.16 * (k - 1.5) for i in range(len(rows))]
        middle = [r["ratio"] for r in rows]
        spans = [[r["ratio"] - r["low"] for r in rows], [r["high"] - r["ratio"] for r in rows]]
        face = color if estimator == "OLS" else "white"
        axes.errorbar(x, middle, spans, fmt=marker, color=color, markerfacecolor=face, label=label, capsize=3, markersize=8)
    axes.axhline(1, color="0.4", lw=1)
    axes.set_yscale("log")
    axes.set_yticks([0.25, 0.5, 1, 2, 5, 10, 20], ["1/4", "1/2", "1", "2", "5", "10", "20"])
    axes.minorticks_off()
    axes.set_xticks(range(len(NOISES)), list(NOISES.values()))
    axes.set_ylabel("typical error of a parameter,\nover the explicit model's")
    axes.set_title(
        "Below 1: more accurate than the explicit model with the same estimator and number of equations",
        loc="left",
        fontsize=11,
    )
    axes.spines[["top", "right"]].set_visible(False)
    axes.grid(axis="y", color="0.9")
    axes.legend(frameon=False, fontsize=8, loc="upper left", bbox_to_anchor=(1, 1))
    figure.savefig(place, dpi=120)


def keep_conclusion(folder: Path) -> None:
    """Keep what a folder of results has of the conclusion, and draw its picture anew."""
    keep_ratios(folder)
    picture(DOCS / "conclusion.png")
