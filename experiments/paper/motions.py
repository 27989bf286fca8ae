"""Which errors do the paper's steps make on motions like the paper's?

The paper specifies the class of its motion (fifth-order point-to-point moves, 40 s at 100 Hz, Cond(W) of 28 and 93), not the
motion. So random motions of the class are drawn, those with the paper's condition numbers are kept, and the distribution of
their errors is laid beside the paper's. No error decides which motion is kept.
"""

import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import groupby
from operator import itemgetter
from typing import Any

import numpy as np
import numpy.typing as npt
from rich.console import Console
from rich.table import Table
from rich.text import Text

from idbench.experiments.errors import ExperimentError
from idbench.experiments.paper.table1 import PAPER, over_explicit
from idbench.experiments.study.job import local_pool
from idbench.experiments.study.study import Study
from idbench.experiments.study.study_file import load_study
from idbench.experiments.text import new_table, print_titled
from idbench.identify import Array
from idbench.sim.engine.simulation import Progress
from idbench.sim.robot.robot import Robot
from idbench.sim.robot.scara import scara_truth

COMPARED = ("paper", "paper_masked")  # Chains whose errors are compared with the paper's
TOGETHER = 50  # Motions that are identified together
BAND = (5.0, 95.0)  # Percentiles between which the paper's error counts as explained
ROUNDED = 5e-4  # Half of the last digit of the paper's errors [%]: 0.001 may be 0.0005 to 0.0015


@dataclass(frozen=True, eq=False)
class Errors:
    """Errors of one chain on the motions that are kept."""

    drawn: int
    """Motions that were drawn and keep the robot's limits."""
    condition: Mapping[str, Array]
    """Cond(W) of each model, shape (motion,)."""
    percent: Mapping[str, Array]
    """Relative errors of each model, without sign [%], shape (motion, p)."""

    @property
    def kept(self) -> int:
        """Number of motions that are kept."""
        return len(next(iter(self.percent.values())))

    def percentiles(self, model: str, q: float) -> Array:
        """Return a percentile of the error of every parameter [%]."""
        return np.asarray(np.percentile(self.percent[model], q, axis=0))

    def explained(self, model: str) -> npt.NDArray[np.bool_]:
        """True where the paper's error of each parameter lies inside the band, shape (p,)."""
        low, high = (self.percentiles(model, q) for q in BAND)
        paper = np.array(PAPER[model].error)
        return (low <= paper + ROUNDED) & (high >= paper - ROUNDED)


@dataclass(frozen=True, eq=False)
class Table1Motions:
    """The errors of Table 1 over random motions with the paper's condition numbers, computed when they are asked for."""

    motions: int
    """How many are drawn."""
    seed: int = 0
    """Of the first; motion i of a seed is the same whatever their number."""
    tolerance: float = 0.3
    """Motions are kept whose condition numbers are within this share of the paper's, in the chain itself."""
    progress: Progress | None = None
    """Receives how much is done."""

    def __post_init__(self) -> None:
        if self.motions < 1 or self.seed < 0:
            raise ExperimentError(f"--motions {self.motions} must be at least 1, and --seed {self.seed} at least 0")

    @cached_property
    def study(self) -> Study:
        """The study that ships as `motions`, with as many."""
        return replace(load_study("motions"), seeds=max(2, self.motions), seed=self.seed)

    @cached_property
    def truth(self) -> dict[str, float]:
        """True parameters of the SCARA."""
        return scara_truth(Robot.load("scara"))

    @cached_property
    def errors(self) -> dict[str, Errors]:
        """The errors of each chain; raise ExperimentError if no motion is kept."""
        found: dict[str, list[tuple[Array, Array]]] = {chain: [] for chain in COMPARED}
        with local_pool(self.study, os.cpu_count() or 1) as pool:
            shards = [pool.submit(range(k, min(k + TOGETHER, self.motions))) for k in range(0, self.motions, TOGETHER)]
            for number, shard in enumerate(shards, 1):
                rows = shard.result().rows
                for chain in COMPARED:
                    found[chain] += self._of_motions([row for row in rows if row["chain"] == chain])
                if self.progress:
                    self.progress(number / len(shards))
        return {chain: self._kept(each) for chain, each in found.items()}

    def _of_motions(self, rows: Sequence[Mapping[str, Any]]) -> Iterator[tuple[Array, Array]]:
        """Yield condition numbers, shape (model,), and errors [%], shape (model, p), of motions within the robot's limits."""
        for _, each in groupby(rows, key=itemgetter("run")):
            models = {row["model"]: row for row in each if row["failure"] is None}
            if set(models) == set(PAPER):
                X = np.array([[models[model][name] for name in self.truth] for model in PAPER])
                truth = np.array(list(self.truth.values()))
                yield np.array([models[m]["condition_number"] for m in PAPER]), 100 * np.abs(X / truth - 1)

    def _kept(self, found: Sequence[tuple[Array, Array]]) -> Errors:
        """Return the errors of motions whose condition numbers are the paper's."""
        paper = np.array([column.condition_number for column in PAPER.values()])
        if not (near := [(c, e) for c, e in found if (np.abs(np.log(c / paper)) <= np.log1p(self.tolerance)).all()]):
            raise ExperimentError(
                f"none of {len(found)} motions has the paper's condition numbers within {self.tolerance:.0%}: "
                "draw more (--motions)"
            )
        conditions, percent = (np.stack(x, axis=1) for x in zip(*near, strict=True))
        return Errors(len(found), dict(zip(PAPER, conditions, strict=True)), dict(zip(PAPER, percent, strict=True)))

    def summary(self) -> dict[str, Any]:
        """Return summary.json."""
        return {
            "experiment": "table1-motions",
            "seed": self.seed,
            "motions": self.motions,
            "parameters": list(self.truth),
            "truth": list(self.truth.values()),
            "paper_percent": {model: list(column.error) for model, column in PAPER.items()},
            "chains": {chain: self._of(errors) for chain, errors in self.errors.items()},
        }

    def _of(self, errors: Errors) -> dict[str, Any]:
        models = {
            model: {
                "median_percent": errors.percentiles(model, 50).tolist(),
                "low_percent": errors.percentiles(model, BAND[0]).tolist(),
                "high_percent": errors.percentiles(model, BAND[1]).tolist(),
                "explained": errors.explained(model).tolist(),
                "median_condition_number": float(np.median(errors.condition[model])),
            }
            for model in PAPER
        }
        return {"drawn": errors.drawn, "kept": errors.kept, "models": models, "over_explicit": relations(errors)}


FEW = 40  # Motions below which less than two lie outside of either end of the band

NAMES = {"paper": "the paper's steps", "paper_masked": "the same, reversals left out"}


def print_motions(console: Console, found: Table1Motions) -> None:
    """Print the paper's errors beside the median and the band of each chain, and how many they explain."""
    for model in PAPER:
        print_titled(console, f"{model} model: errors [%]; a star where the paper's lies inside the band", _table(found, model))
    for chain in COMPARED:
        console.print(Text(_said(found, chain)), soft_wrap=True)


def _table(found: Table1Motions, model: str) -> Table:
    heads = [f"{chain}\n{what}" for chain in COMPARED for what in ("median", f"{BAND[0]:g} to {BAND[1]:g} %", "")]
    grid = new_table("", ["paper's\n%e", *heads])
    for i, name in enumerate(found.truth):
        cells = [cell for chain in COMPARED for cell in _cells(found.errors[chain], model, i)]
        grid.add_row(name, f"{PAPER[model].error[i]:.3f}", *cells)
    grid.add_section()
    conditions = (f"{np.median(found.errors[chain].condition[model]):.0f}" for chain in COMPARED)
    grid.add_row("Cond(W)", f"{PAPER[model].condition_number:g}", *(cell for c in conditions for cell in (c, "", "")))
    return grid


def _cells(errors: Errors, model: str, i: int) -> tuple[str, str, str]:
    low, middle, high = (errors.percentiles(model, q)[i] for q in (BAND[0], 50, BAND[1]))
    return f"{middle:.2g}", f"{low:.1g} to {high:.2g}", "*" if errors.explained(model)[i] else ""


def _said(found: Table1Motions, chain: str) -> str:
    errors = found.errors[chain]
    inside = sum(int(np.count_nonzero(errors.explained(model))) for model in PAPER)
    cells = len(PAPER) * len(found.truth)
    which = [i for i, name in enumerate(found.truth) if name.startswith("F")]
    times = errors.percentiles("explicit", 50)[which] / np.array(PAPER["explicit"].error)[which]
    friction = float(np.exp(np.mean(np.log(times))))
    few = f"; so few motions make no band, draw more than {found.motions}" if errors.kept < FEW else ""
    each = "those of {0} are {paper:.2g} times or more in {reached:.0%}, all larger in {all_larger:.0%}"
    over = [each.format(model, **of) for model, of in relations(errors).items()]
    return (
        f"{NAMES[chain]} (chain {chain}): {errors.kept} of {errors.drawn} motions have the paper's Cond(W) within "
        f"{found.tolerance:.0%}; {inside} of {cells} of the paper's errors lie inside the band; the friction errors of the "
        f"explicit model are {friction:.2g} times the paper's (geometric mean of the medians){few}. "
        f"Over the explicit model's errors, {'; '.join(over)} of these motions"
    )


def relations(errors: Errors) -> dict[str, dict[str, float]]:
    """Errors of other models over the explicit one's: the paper's, the median, and shares of motions that have them."""
    found = dict[str, dict[str, float]]()
    for model, paper in over_explicit({model: column.error for model, column in PAPER.items()}).items():
        times = errors.percent[model] / errors.percent["explicit"]
        means, worse = np.exp(np.log(times).mean(axis=1)), float((times > 1).all(axis=1).mean())
        shares = {"reached": float((means >= paper).mean()), "all_larger": worse}
        found[model] = {"paper": paper, "median": float(np.median(means)), **shares}
    return found
