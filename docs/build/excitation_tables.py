"""Tables of the studies of excitation."""

import json
from collections.abc import Iterator, Sequence
from math import exp, log

from results import RESULTS, Cell, cells, table, typical

CRITERIA = {
    "sigma": "mean ln sigma",
    "determinant": "ln det(W' C⁻¹ W)",
    "smallest": "s_min(W)",
    "random": "none: the median of 60 random motions",
    "birdy": "Cond(W' W) + 100 / s_min(W)",
    "condition": "Cond(W)",
}
ARMS = {"scara": "", "puma560": "-puma", "panda": "-panda"}


def _predicted(name: str, bits: str = "17") -> Cell:
    """Return what is predicted of a motion, as if it were a cell."""
    found = json.loads((RESULTS / "excitation-motions.json").read_text())[name]
    return {"condition": found["condition"], "rmse_percent": [x for x in found["sigma_percent"][bits] if x]}


def _of_motions(study: str) -> dict[str, Cell]:
    return {str(c["settings"]["trajectory"]).removeprefix("excited/"): c for c in cells(study) if c["model"] == "explicit"}


def criteria() -> Iterator[str]:
    """Yield what each criterion comes to."""

    def rows() -> Iterator[Sequence[str]]:
        found = {arm: _of_motions(f"excitation-criteria{end}") for arm, end in ARMS.items()}
        for criterion, words in CRITERIA.items():
            row = [words]
            for arm, cells_of in found.items():
                name = f"{arm}-{criterion}"
                predicted = _predicted(name)
                row += [f"{predicted['condition']:.3g}", typical(predicted), typical(cells_of[name])]
            yield row

    heads = [f"{arm}: {what}" for arm in ARMS for what in ("Cond(W)", "predicted", "found")]
    yield from table(["what is optimised", *heads], rows())


def foretold() -> Iterator[str]:
    """Yield errors over what was predicted of them."""
    motions = json.loads((RESULTS / "excitation-motions.json").read_text())
    bits = {0.0: ("24", "none"), 1.384e-05: ("17", "17 bits"), 1.107e-04: ("14", "14 bits")}

    def rows() -> Iterator[Sequence[str]]:
        for level, (number, words) in bits.items():
            row = [words]
            for arm, end in (("scara", ""), ("puma560", "-puma")):
                study = cells(f"excitation-predicted{end}")
                each = {c["estimator"]: c for c in study if c["settings"]["encoder.noise"] == level}
                predicted = motions[f"{arm}-sigma"]["sigma_percent"][number]
                row += [f"{_ratio(each[method], predicted):.2f}" for method in ("GLS", "ML")]
            yield row

    heads = [f"{arm}, {method}" for arm in ("scara", "puma560") for method in ("GLS", "ML")]
    yield from table(["noise of the positions", *heads], rows())


def _ratio(cell: Cell, predicted: Sequence[float | None]) -> float:
    """Return the geometric mean of errors over what was predicted."""
    pairs = [(e, p) for e, p in zip(cell["rmse_percent"], predicted, strict=True) if e and p]
    return exp(sum(log(e / p) for e, p in pairs) / len(pairs))
