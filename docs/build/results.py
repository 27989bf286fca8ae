"""What is kept of the results of studies, and the tables of pages that are made of it."""

import json
from collections.abc import Iterator, Sequence
from math import exp, log
from pathlib import Path
from typing import Any

DOCS = Path(__file__).absolute().parent.parent
RESULTS = DOCS / "results"
KEPT = (
    "settings",
    "chain",
    "estimator",
    "model",
    "runs",
    "rmse_percent",
    "coverage",
    "paper_coverage",
    "bound_percent",
    "bound_through_reversals_percent",
)
"""What is kept of a cell."""

COMPARED = ("bias_percent", "bias_margin_percent", "failures", "simulations")
"""What is kept, too, of a cell of a study that compares estimators."""

Cell = dict[str, Any]
Column = tuple[str, str]


def keep(folder: Path) -> None:
    """Keep of the results of studies what the pages need."""
    for path in sorted(folder.glob("*/summary.json")):
        summary = json.loads(path.read_text())
        if "attribution_percent" in summary:
            kept = {name: summary[name] for name in ("parameters", "attribution_percent")}
            models = summary["paper_processing"]
            kept["paper_sigma"] = {model: short(models[model]["paper_sigma"]) for model in models}
            (RESULTS / f"{path.parent.name}.json").write_text(json.dumps(kept, indent=1) + "\n")
            continue
        named = ("settings", "runs", "named", "misnamed")
        kept_of = (
            named
            if "named" in summary["cells"][0]
            else (*KEPT, *COMPARED)
            if path.parent.name.startswith("estimators")
            else KEPT
        )
        cells = [{key: short(cell.get(key)) for key in kept_of if key in cell} for cell in summary["cells"]]
        text = "[\n" + ",\n".join(json.dumps(cell) for cell in cells) + "\n]\n"
        (RESULTS / f"{path.parent.name}.json").write_text(text)


def short(value: Any) -> Any:
    """Return numbers to six digits: what is printed has two."""
    if isinstance(value, list):
        return [short(x) for x in value]
    return float(f"{value:.6g}") if isinstance(value, float) else value


def cells(study: str) -> list[Cell]:
    """Return the cells of a study."""
    found: list[Cell] = json.loads((RESULTS / f"{study}.json").read_text())
    return found


def by_settings(study: str) -> Iterator[tuple[dict[str, Any], dict[Column, Cell]]]:
    """Yield settings, and the cells of each by chain and model."""
    groups: dict[str, dict[Column, Cell]] = {}
    for cell in cells(study):
        groups.setdefault(json.dumps(cell["settings"], sort_keys=True), {})[cell["chain"], cell["model"]] = cell
    for settings, group in groups.items():
        yield json.loads(settings), group


def typical(cell: Cell) -> str:
    """Return the geometric mean of the rms errors, to two digits."""
    errors = [float(x) for x in cell["rmse_percent"] if x is not None]  # of what is zero in truth there is none
    mean = exp(sum(map(log, errors)) / len(errors))
    return f"{mean:.0f}" if mean >= 10 else f"{mean:#.2g}"


def coverage(cell: Cell, key: str = "coverage", digits: int = 0) -> str:
    """Return the mean share of truths within two sigma, with the lowest and the highest parameter's."""
    shares = [100 * float(x) for x in cell[key]]
    mean, low, high = (f"{x:.{digits}f}" for x in (sum(shares) / len(shares), min(shares), max(shares)))
    return mean if low == high else f"{mean} ({low}-{high})"


def table(head: Sequence[str], rows: Iterator[Sequence[str]]) -> Iterator[str]:
    """Yield the lines of a table of Markdown, numbers to the right."""
    yield f"\n|{'|'.join(head)}|\n|---|{'---:|' * (len(head) - 1)}\n"
    for row in rows:
        yield f"|{'|'.join(row)}|\n"
    yield "\n"
