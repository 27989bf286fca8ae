"""Does the paper's experiment (Table 2) come out of a simulated robot, and what made its negative friction?

Expected: processed as the paper did, Fv1 negative and Fs1 inflated in all three models, the two dynamic models equal; aligned
and masked, all parameters close to a truth that the paper did not have.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table
from rich.text import Text

from idbench.experiments.identification.fit import Fit
from idbench.experiments.identification.fitting import fit
from idbench.experiments.identification.logs import Logs
from idbench.experiments.identification.method import Method
from idbench.experiments.identification.request import Request
from idbench.experiments.identification.robot_model import RobotModel
from idbench.experiments.paper.attribution import Attribution, Errors
from idbench.experiments.paper.table1 import conclusion_line, over_explicit, paper_columns, settled
from idbench.experiments.text import new_table, percent, print_table, printed
from idbench.identify import Estimate, TorqueChannel
from idbench.sim.engine.run import Run
from idbench.sim.engine.simulation import Progress, simulate
from idbench.sim.engine.watch import Watch
from idbench.sim.robot.scara import scara_truth
from idbench.sim.scenario.scenario import Scenario
from idbench.sim.scenario.scenario_file import to_dict

REALIZATIONS: Mapping[str, int] = {"explicit": 2, "implicit": 2, "power": 4}
"""Realizations of the trajectory that make r = 1600 rows (section 7.3)."""

PROCESSINGS: Mapping[str, tuple[str, str]] = {"paper": ("paper", "OLS"), "idbench": ("idbench", "WLS")}
"""Chain and estimator: as the paper processed its data, and aligned, masked and weighted."""


@dataclass(frozen=True)
class Table2Column:
    """What the paper's Table 2 prints for a model."""

    estimate: tuple[float, ...]
    """X of the eight parameters."""
    two_sigma: tuple[float, ...]
    """2 sigma of each."""
    relative_sigma_percent: tuple[float, ...]
    """%sigma of each."""
    condition_number: float
    """Cond(W)."""


PAPER: Mapping[str, Table2Column] = {model: Table2Column(**of) for model, of in paper_columns("table2").items()}
"""Table 2 of the paper."""

PAPER_ROWS = 1600  # r of every column of Table 2 (section 7.3)


@dataclass(frozen=True, eq=False)
class Table2:
    """The comparison, computed when it is asked for."""

    scenario: Scenario
    """The robot and its motion; realization k has seed + k."""
    progress: Progress | None = None
    """Receives how much of the simulation is done."""
    watch: Watch | None = None
    """Receives what happens in the first realization."""

    def __repr__(self) -> str:
        return printed(lambda console: print_table2(console, self))

    def __post_init__(self) -> None:
        scara_truth(self.scenario.real_robot)
        held = TorqueChannel("held", self.scenario.timing.delay)
        for name, _ in PROCESSINGS.values():
            settled(name, self.rest, self.scenario.fs, held)

    @cached_property
    def run(self) -> Run:
        """As many realizations as the power model needs."""
        first = self.scenario.seed
        seeds = range(first, first + max(REALIZATIONS.values()))
        _ = self._attribution  # begins, now that this process is busy
        return simulate(self.scenario, seeds, progress=self.progress, watch=self.watch)

    @cached_property
    def truth(self) -> dict[str, float]:
        """The true parameters."""
        return scara_truth(self.run.robots[0])

    @cached_property
    def found(self) -> dict[str, dict[str, Fit]]:
        """What each processing makes of each model's realizations."""
        return {name: {model: self._identified(name, model) for model in REALIZATIONS} for name in PROCESSINGS}

    def _identified(self, processing: str, model: str) -> Fit:
        logs = tuple(self.run.alone(i) for i in range(REALIZATIONS[model]))
        chain, estimator = PROCESSINGS[processing]
        request = Request(RobotModel(self.scenario.robot), (model,), Method.named(chain, estimator).trimmed(self.rest))
        return fit(request, Logs(logs, truth=self.truth))

    @property
    def rest(self) -> float:
        """Time at rest at either end of a realization, which makes no rows [s]."""
        return self.scenario.quintic().rest

    @cached_property
    def attribution(self) -> dict[str, Errors]:
        """Signed error [%] of every parameter by every imperfection alone."""
        return self._attribution.errors(self.progress)

    def close(self) -> None:
        """End what was begun and is not finished."""
        if "_attribution" in self.__dict__:
            self._attribution.stop()

    @cached_property
    def _attribution(self) -> Attribution:
        return Attribution(self.scenario)

    def summary(self) -> dict[str, Any]:
        """Return summary.json: `models` holds processing `idbench`, `paper_processing` that of the paper."""
        parts = {name: [one.summary() for one in found.values()] for name, found in self.found.items()}
        models = {name: {k: v for part in some for k, v in part["models"].items()} for name, some in parts.items()}
        common = parts["idbench"][0]
        return {
            "experiment": "table2",
            "seed": self.scenario.seed,
            "scenario": to_dict(self.scenario),
            **{key: common[key] for key in ("parameters", "truth", "robot", "chain", "estimator", "torque")},
            "models": models["idbench"],
            "paper_processing": models["paper"],
            "attribution_percent": {
                name: {form: np.round(error, 6).tolist() for form, error in errors.items()}
                for name, errors in self.attribution.items()
            },
        }


def print_table2(console: Console, table: Table2) -> None:
    """Print the paper's Table 2 beside its twin, processed twice, and what each imperfection does alone."""
    console.print(Text(f"Scenario {table.scenario.name}: {table.scenario.origin}\n"))
    for model in REALIZATIONS:
        print_table(console, _twin(table, model), 2)
    console.print(
        Text("2s: 2 sigma, %s: %sigma, %e: error. Processed as in the paper (chain paper, OLS), and by chain idbench, WLS.\n")
    )
    sigmas: dict[str, dict[str, Any]] = {"the paper": {model: column.two_sigma for model, column in PAPER.items()}}
    sigmas |= {name: {m: one.estimates[m].own_sigma for m, one in each.items()} for name, each in table.found.items()}
    over = ", ".join(f"{over_explicit(of)['power']:.2g} ({name})" for name, of in sigmas.items())
    console.print(Text(f"Sigmas of the power model over those of the explicit one, geometric means: {over}.\n"))
    console.print(Text("What each imperfection does alone, chain idbench: error of each parameter [%]\n"))
    for form in next(iter(table.attribution.values())):
        grid = new_table(f"{form} model", table.truth)
        for name, errors in table.attribution.items():
            grid.add_row(name, *(percent(error) for error in errors[form]))
        print_table(console, grid)
    console.print(Text(conclusion_line()))


def _twin(table: Table2, model: str) -> Table:
    paper, found = PAPER[model], {name: each[model] for name, each in table.found.items()}
    estimates = {name: one.estimates[model] for name, one in found.items()}
    heads = [f"{name}\n{what}" for name in found for what in ("X", "2s", "%s", "%e")]
    columns = ["true\nX", *(f"Table 2\n{what}" for what in ("X", "2s", "%s")), *heads]
    grid = new_table(f"{model} model, {REALIZATIONS[model]} realizations", columns)
    for i, (name, true) in enumerate(table.truth.items()):
        printed = f"{paper.estimate[i]:g}", f"{paper.two_sigma[i]:g}", f"{paper.relative_sigma_percent[i]:g}"
        cells = [c for e in estimates.values() for c in _with_sigma(e, i, list(table.truth.values()))]
        grid.add_row(name, f"{true:g}", *printed, *cells)
    grid.add_section()
    conds = [c for e in estimates.values() for c in (f"{e.condition_number:.0f}", "", "", "")]
    grid.add_row("Cond(W)", "", f"{paper.condition_number:g}", "", "", *conds)
    grid.add_row("rows", "", f"{PAPER_ROWS}", "", "", *(c for e in estimates.values() for c in (f"{e.row_count}", "", "", "")))
    return grid


def _with_sigma(estimate: Estimate, i: int, truth: list[float]) -> tuple[str, str, str, str]:
    return (
        f"{estimate.X[i]:.4f}",
        f"{2 * estimate.own_sigma[i]:.2g}",
        f"{estimate.paper_sigma_percent[i]:.2g}",
        percent(float(estimate.error_percent(truth)[i])),
    )
