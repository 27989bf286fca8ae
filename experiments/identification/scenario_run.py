"""A scenario, simulated and identified: what do its imperfections do to each model?"""

import sys
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

from experiments.errors import ExperimentError
from experiments.identification.choices import Consistency, Start
from experiments.identification.defaults import CHAIN, ESTIMATOR
from experiments.identification.friction_choice import with_suitable_friction
from experiments.identification.identified import Identified
from experiments.identification.iterations import iterations
from experiments.identification.parameters import Parameters
from experiments.identification.simulators import require_start
from experiments.identification.subject import Subject
from identify import AbstractEstimator, Chain
from sim.engine.run import Run
from sim.engine.simulation import Progress, simulate
from sim.engine.watch import Watch
from sim.scenario.scenario import Scenario
from sim.scenario.scenario_file import to_dict

LONG, ENDLESS = 3e6, 1e9
"""Physics steps from which on a simulation takes minutes, and hours or days."""


@dataclass(frozen=True, eq=False)
class ScenarioRun:
    """A scenario, simulated and identified when it is asked for.

    Parameters
    ----------
    scenario : Scenario
        What to run.
    chain, estimator : str
        Their names.
    method : tuple of Chain and AbstractEstimator, optional
        Both with settings of their own, instead of those that have the names.
    progress : callable, optional
        Receives how much of the simulation is done.
    watch : Watch, optional
        Receives what happens in it.
    parameters : Parameters
        Which parameters are identified.
    start : {"least-squares", "file"}
        Where estimators begin that simulate or filter.
    consistent : {"no", "pullback", "entropic"}
        Whether estimates are moved to where bodies can exist.
    """

    scenario: Scenario
    chain: str = CHAIN
    estimator: str = ESTIMATOR
    method: tuple[Chain, AbstractEstimator] | None = None
    progress: Progress | None = None
    watch: Watch | None = None
    parameters: Parameters = Parameters()  # noqa: RUF009  # frozen
    start: Start = "least-squares"
    consistent: Consistency = "no"

    def __post_init__(self) -> None:
        # What is wrong with names, or a robot that is no SCARA, is reported before the simulation.
        found = Identified((), self.subject, chain=self.chain, estimator=self.estimator)
        require_start(self.start, self.estimator, self.method[1] if self.method else found.solver)
        self.subject.truth(self.scenario.real_robot, self.scenario.friction)

    def require_bearable(self, yes: bool) -> None:
        """Say how long a simulation is that takes long; raise ExperimentError if it would hardly end, unless that is wanted."""
        h = self.scenario.drive.step_length(self.scenario.fs, self.scenario.physics.step)
        steps = self.scenario.trajectory.plan(self.scenario.real_robot).duration / h
        size = f"{steps:.1e} physics steps of {h:.2g} s"
        if steps > ENDLESS and not yes:
            raise ExperimentError(f"scenario {self.scenario.name} makes {size}: hours or days; if you mean it, add --yes")
        if steps > LONG:
            sys.stderr.write(f"idbench: {size} are to be simulated, some tens of thousands a second\n")

    @cached_property
    def subject(self) -> Subject:
        """The robot."""
        return Subject(self.scenario.robot, self.parameters)

    @cached_property
    def run(self) -> Run:
        """The simulation."""
        return simulate(self.scenario, progress=self.progress, watch=self.watch)

    @cached_property
    def identified(self) -> Identified:
        """What the models make of its log."""
        log, name = (self.run.alone(),), f"{self.chain}-{self.estimator}-study" if self.method else ""
        found = Identified(log, self.subject, chain=self.chain, estimator=self.estimator, method=self.method, name=name)
        found = replace(found, loops=(self.scenario,), start=self.start, consistent=self.consistent)
        if self.subject.laws.auto:
            found, _ = with_suitable_friction(found)
        return replace(found, truth=found.subject.truth(self.run.robots[0], self.scenario.friction))

    def summary(self) -> dict[str, Any]:
        """Return summary.json."""
        return {
            "experiment": "run",
            "seed": self.scenario.seed,
            "scenario": to_dict(self.scenario),
            **self.identified.summary(),
            "iterations": iterations(self.identified),
        }
