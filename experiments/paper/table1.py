"""Does the paper's Table 1 come out: which systematic error do filters and differences make in each of the three models?

Expected: with the paper's own steps ZZR1 slightly too large in all models, by its differences, and friction off in the dynamic
models, by reversals; with chain `idbench` no error above 0.001 %, so that nothing but the method limited the paper.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

from idbench.experiments.errors import ExperimentError
from idbench.experiments.identification.rates import Rates
from idbench.experiments.results.writing import summarize
from idbench.experiments.text import printed
from idbench.identify import (
    CHAINS,
    MODELS,
    Chain,
    Estimate,
    MotionLog,
    OrdinaryLeastSquares,
    identify_each,
    scara,
)
from idbench.sim.engine.run import ideal_log
from idbench.sim.robot.robot import Robot
from idbench.sim.robot.scara import scara_truth
from idbench.sim.scenario.scenario import Scenario
from idbench.sim.scenario.scenario_file import to_dict
from idbench.sim.trajectories import Reference

CHAINS_COMPARED = ("paper", "paper_masked", "idbench")  # Chains of the comparison
SCENARIO = "table1"  # The scenario that ships


@dataclass(frozen=True)
class Table1Column:
    """What the paper's Table 1 prints for one model."""

    estimate: tuple[float, ...]
    """X of the eight parameters."""
    error: tuple[float, ...]
    """%e of the eight parameters."""
    condition_number: float
    """Cond(W)."""
    rows: int
    """r."""


PAPER: Mapping[str, Table1Column] = {
    "explicit": Table1Column(
        (3.501, 0.049, 0.500, 0.060, 0.120, 0.005, 0.010, 0.100),
        (0.040, 0.207, 0.008, 0.003, 0.014, 0.040, 0.024, 0.006),
        28,
        800,
    ),
    "implicit": Table1Column(
        (3.501, 0.049, 0.500, 0.060, 0.120, 0.005, 0.010, 0.100),
        (0.042, 0.649, 0.011, 0.008, 0.072, 0.369, 0.049, 0.015),
        28,
        800,
    ),
    "power": Table1Column(
        (3.502, 0.049, 0.501, 0.060, 0.120, 0.005, 0.010, 0.099),
        (0.057, 1.064, 0.114, 0.001, 0.089, 0.613, 0.622, 0.346),
        93,
        400,
    ),
}
"""Table 1 and section 7.2 of the paper."""


@dataclass(frozen=True, eq=False)
class Table1:
    """The comparison, computed when it is asked for."""

    scenario: Scenario
    """The motion."""
    chains: tuple[str, ...]
    """Names of the chains to compare."""

    def __repr__(self) -> str:
        from idbench.experiments.paper.table1_text import print_table1

        return printed(lambda console: print_table1(console, self))

    def __post_init__(self) -> None:
        for name in self.chains:
            CHAINS.create(name)

    @cached_property
    def robot(self) -> Robot:
        """The SCARA."""
        return Robot.load(self.scenario.robot)

    @cached_property
    def truth(self) -> dict[str, float]:
        """The true parameters, from the compiled model."""
        return scara_truth(self.robot)

    @cached_property
    def reference(self) -> Reference:
        """The motion, sampled."""
        return self.scenario.trajectory.sample(self.robot, self.scenario.fs)

    @cached_property
    def log(self) -> MotionLog:
        """Ideal data of the motion."""
        return ideal_log(self.robot, self.reference)

    @cached_property
    def estimates(self) -> dict[str, dict[str, Estimate]]:
        """The estimate of every form, by chain."""
        return {name: self._identified(self._settled(name)) for name in self.chains}

    @property
    def rates(self) -> dict[str, Rates]:
        """Sampling and filter frequencies of each chain, in multiples of what the motion has of the loop's bandwidth."""
        log, qd = self.log, self.reference.qd.T
        rows = {name: int(found["explicit"].row_count) for name, found in self.estimates.items()}
        made = {name: CHAINS.create(name) for name in self.chains}
        chains = {name: replace(chain, prefilter=chain.suited_prefilter(log)) for name, chain in made.items()}
        return {name: Rates.of(chain, log.fs, rows[name], None, "from the motion", qd) for name, chain in chains.items()}

    def summary(self) -> dict[str, Any]:
        """Return summary.json: `models` holds the last of the chains, `<name>_chain` the others."""
        truth = list(self.truth.values())
        by_chain = {name: {form: summarize(e, truth) for form, e in found.items()} for name, found in self.estimates.items()}
        *others, main = self.chains
        return {
            "experiment": "table1",
            "seed": self.scenario.seed,
            "scenario": to_dict(self.scenario),
            "parameters": list(self.truth),
            "units": list(scara().units),
            "truth": truth,
            "chain": main,
            "models": by_chain[main],
            **{f"{name}_chain": by_chain[name] for name in others},
        }

    def _settled(self, name: str) -> Chain:
        """Return the chain `name`, its filters settling while the robot rests."""
        chain, rest = CHAINS.create(name), self.scenario.quintic().rest
        if (halo := chain.halo(self.log.fs, self.log.torque)) > rest:
            raise ExperimentError(f"rest = {rest:g} s is shorter than the {halo:.3g} s that chain {name} looks: raise it")
        return replace(chain, trim=rest)

    def _identified(self, chain: Chain) -> dict[str, Estimate]:
        """Return the estimates of the three models, and of two integrated ones: energy (Eq. 11, 20), integral (after Eq. 9)."""
        models = {name: MODELS.create(name) for name in MODELS}
        return identify_each(self.log, scara(), models, chain, OrdinaryLeastSquares())
