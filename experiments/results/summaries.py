"""What summary.json holds."""

import json
from importlib.metadata import version
from math import isfinite
from pathlib import Path
from typing import Any

from idbench.identify import Estimate


def write_summary(path: Path, summary: dict[str, Any]) -> None:
    """Write `summary` as JSON, with the version of idbench."""
    text = json.dumps({"version": version("idbench"), **summary}, indent=2, allow_nan=False)
    path.write_text(text + "\n", encoding="utf-8")


def summarize(estimate: Estimate, truth: list[float] | None) -> dict[str, Any]:
    """Return one model's entry of a summary: estimate, error if known, standard errors, Cond(W), rows, residual."""
    return {
        "estimate": estimate.X.tolist(),
        "relative_error_percent": None if truth is None else [finite(x) for x in estimate.relative_error_percent(truth)],
        "sigma": estimate.own_sigma.tolist(),
        "corrected_sigma": [finite(x) for x in estimate.calibrated_sigma],
        "relative_sigma_percent": [finite(x) for x in estimate.paper_sigma_percent],
        "condition_number": float(estimate.condition_number),
        "rows": int(estimate.row_count),
        "residual_rms": float(estimate.residual_rms),
    }


def finite(x: float) -> float | None:
    """Return a number, None instead of one that JSON has no word for."""
    return float(x) if isfinite(x) else None
