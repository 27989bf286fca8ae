"""The tables of simulated arms, given to other tools: errors, coverage and seconds.

    uv run python docs/build/simulated_tables.py runs/simulated

keeps in docs/results what the page needs of the results of tests/benchmarks/public_sets.py on the sets that
tests/benchmarks/peers/simulated.py makes, and of the files of other tools beside them.
"""

import ast
import json
import sys
from collections import defaultdict
from collections.abc import Iterator, Sequence
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np
from results import DOCS, RESULTS, short, table

OWN = "idbench"
TOOLS = {"idbench": "idbench", "pinocchio": "least squares", "figaroh": "FIGAROH", "flobaroid": "FloBaRoID"}
SCRIPTS = {"pinocchio": "least_squares.py", "figaroh": "figaroh_tool.py", "flobaroid": "flobaroid_tool.py"}
"""What a user of a tool writes."""

PEERS = DOCS.parent / "tests" / "benchmarks" / "peers"

KEPT = RESULTS / "benchmark-simulated.json"
ARMS = ("scara", "puma560", "panda")
IMPERFECTIONS = ("torque noise", "encoder", "delay", "friction by load", "all four", "all four, law chosen")
OWN_ALONE = IMPERFECTIONS[-1]
"""What idbench alone does."""

TRUE = ("torque noise", "encoder", "delay")
"""Imperfections with which parameters have true values: friction that nobody models has none."""

SLOW = 0.05
"""Share of its rms speed below which a joint counts as slow."""

SIGMAS = 2.0

Row = dict[str, Any]
Array = np.ndarray[Any, Any]


def keep(folder: Path) -> None:
    """Keep of the results of each arm, imperfection and tool what the page needs."""
    groups = defaultdict[tuple[str, str], list[Path]](list)
    for path in sorted(folder.glob("*/summary.json")):
        arm, imperfection, _ = json.loads(path.read_text())["title"].split("; ")
        groups[arm, imperfection].append(path.parent)
    rows = [
        {
            "arm": arm,
            "imperfection": what,
            "logs": len(places := groups[arm, what]),
            "tools": {tool: _of_tool(tool, places) for tool in TOOLS if tool == OWN or what != OWN_ALONE},
        }
        for arm in ARMS
        for what in IMPERFECTIONS
    ]
    lines = {OWN: _definition(), **{tool: _lines(PEERS / name) for tool, name in SCRIPTS.items()}}
    KEPT.write_text(json.dumps({"lines": lines, "rows": rows}, indent=1) + "\n")


def _of_tool(tool: str, places: Sequence[Path]) -> Row:
    """Return errors of predicted torques over the torques [%], of it the same in all logs, coverage, seconds, failures."""
    found = [one for place in places if (one := _of_log(tool, place)) is not None]
    if not found:
        return {"failures": len(places)}
    off = np.array([each["off"] for each in found])
    level = np.sqrt(np.nanmean(found[0]["tau"] ** 2, axis=0))
    error, bias = (100 * np.sqrt(np.nanmean(x**2, axis=0)) / level for x in (off.reshape(-1, off.shape[-1]), off.mean(axis=0)))
    inside = [np.mean(np.abs(each["z"]) < SIGMAS) for each in found]
    return {
        "failures": len(places) - len(found),
        "percent": short(median(error.tolist())),
        "bias": short(median(bias.tolist())),
        "inside": short(float(np.mean(inside))),
        "seconds": short(median(each["seconds"] for each in found)),
    }


def _of_log(tool: str, place: Path) -> Row | None:
    """Return what a tool predicts of the held-out log less its torque, where the joints move, and errors over sigma."""
    held_out, row = np.load(place / "held_out1.npz"), json.loads((place / "summary.json").read_text())
    if tool == OWN:
        estimate, predicted, seconds = row["estimate"], held_out["idbench"], row["seconds"]
        X, sigma, true = (np.array(estimate[name], dtype=float) for name in ("X", "sigma", "filed"))
    else:
        path = place / f"predicted-{tool}.npz"
        if not path.exists():
            return None
        with np.load(path) as file:
            predicted, seconds = file["held_out1"], float(file["seconds"])
            X, sigma, true = file["estimate"], file["sigma"], file["exact"]
    qd = np.gradient(held_out["q"], held_out["t"], axis=0)
    moving = np.abs(qd) > SLOW * np.sqrt((qd**2).mean(axis=0))
    tau = np.where(moving, held_out["tau"], np.nan)
    return {"off": predicted - tau, "tau": tau, "z": (X - true) / sigma, "seconds": seconds}


def _lines(path: Path) -> int:
    """Return the lines of a script that are neither blank nor words."""
    tree = ast.parse(path.read_text())
    words = {
        line
        for node in ast.walk(tree)
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant) and isinstance(node.value.value, str)
        for line in range(node.lineno, (node.end_lineno or node.lineno) + 1)
    }
    lines = enumerate(path.read_text().split("\n"), 1)
    return sum(bool(line.strip()) and not line.strip().startswith("#") and k not in words for k, line in lines)


def _definition() -> int:
    """Return the lines of a set of idbench."""
    values = (node.value for node in ast.parse((PEERS / "simulated.py").read_text()).body if isinstance(node, ast.Assign))
    texts = [value.value for value in values if isinstance(value, ast.Constant) and isinstance(value.value, str)]
    return next(text.count("\n") for text in texts if "held_out" in text)


def _kept() -> Row:
    found: Row = json.loads(KEPT.read_text())
    return found


def errors() -> Iterator[str]:
    """Yield errors by arm, imperfection and tool, of it bias in brackets [% of the torque of the median joint]."""
    head = ["arm", "imperfection", *TOOLS.values()]
    rows = ([row["arm"], row["imperfection"], *(_error(row["tools"].get(tool)) for tool in TOOLS)] for row in _kept()["rows"])
    yield from table(head, rows)


def _error(of: Row | None) -> str:
    if of is None:
        return ""
    failed = f", {of['failures']} failed" if of["failures"] else ""
    return f"{_two(of['percent'])} ({_two(of['bias'])}){failed}" if "percent" in of else "failed"


def _two(x: float) -> str:
    return f"{x:.1g}" if x < 1e-3 else f"{x:.2g}"


SIMULATED_TABLES = {"simulated-tools": errors}

if __name__ == "__main__":
    keep(Path(sys.argv[1]))
