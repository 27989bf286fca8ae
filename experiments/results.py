"""The folder that every experiment writes: whole, or not at all."""

import json
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.metadata import version
from pathlib import Path
from typing import Any

from experiments.errors import ResultsError
from identify import Estimate


@contextmanager
def results_folder(out: Path) -> Iterator[Path]:
    """Give a folder beside `out` to write into; on success its files replace those of the same names in `out`.

    Nothing in `out` changes if the block raises, is interrupted, or the disk is full.

    Raises
    ------
    ResultsError
        If `out` cannot be written, or is a file.
    """
    if out.exists() and not out.is_dir():
        raise ResultsError(f"{out} is a file, not a folder: choose another --out")
    try:
        out.parent.mkdir(parents=True, exist_ok=True)
        beside = Path(tempfile.mkdtemp(prefix=f".{out.name}.", dir=out.parent))
    except OSError as error:
        raise ResultsError(f"cannot write to {out}: {error.strerror}; choose another --out") from error
    try:
        yield beside
        out.mkdir(exist_ok=True)
        for path in sorted(beside.iterdir()):
            path.replace(out / path.name)
    except OSError as error:
        raise ResultsError(f"cannot write to {out}: {error.strerror or error}; nothing there was changed") from error
    finally:
        shutil.rmtree(beside, ignore_errors=True)


def write_summary(path: Path, summary: dict[str, Any]) -> None:
    """Write `summary` as JSON, with the version of idbench."""
    path.write_text(json.dumps({"version": version("idbench"), **summary}, indent=2, allow_nan=False) + "\n")


def summarize(estimate: Estimate, truth: list[float]) -> dict[str, Any]:
    """Return one model's entry of a summary: estimate, error, sigma, condition number, rows, residual."""
    return {
        "estimate": estimate.X.tolist(),
        "relative_error_percent": estimate.relative_error_percent(truth).tolist(),
        "sigma": estimate.sigma.tolist(),
        "relative_sigma_percent": estimate.relative_sigma_percent.tolist(),
        "condition_number": float(estimate.condition_number),
        "rows": int(estimate.rows),
        "residual_rms": float(estimate.residual_rms),
    }
