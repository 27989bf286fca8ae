"""Tables of the studies of excitation."""

import json
from collections.abc import Iterator, Sequence

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
