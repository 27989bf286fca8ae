"""A scenario, simulated and identified: what do its imperfections do to each model?"""

import sys
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from idbench.experiments.document import Conclusion
from idbench.experiments.errors import ExperimentError
from idbench.experiments.identification.causes import remedy_of
from idbench.experiments.identification.fit import Fit
from idbench.experiments.identification.fitting import fit
from idbench.experiments.identification.iterations import iterations
from idbench.experiments.identification.logs import Logs
from idbench.experiments.identification.request import Request
from idbench.experiments.program import program
from idbench.identify.blame import is_mistake
from idbench.sim.engine.rejection import Rejection, rejection
from idbench.sim.engine.run import Run
from idbench.sim.engine.simulation import Progress, simulate
from idbench.sim.engine.watch import Watch
from idbench.sim.scenario.measurement import Ripple
from idbench.sim.scenario.scenario import Scenario
from idbench.sim.scenario.scenario_file import to_dict

LONG, ENDLESS = 3e6, 1e9  # Physics steps from which on a simulation takes minutes, and hours or days


@dataclass(frozen=True, eq=False)
class ScenarioRun:
    """A scenario, simulated and identified when it is asked for."""

    scenario: Scenario
    """What to run."""
    request: Request
    """How its log is identified."""
    progress: Progress | None = None
    """Receives how much of the simulation is done."""
    watch: Watch | None = None
    """Receives what happens in it."""

    def __post_init__(self) -> None:
        # A robot that does not fit is reported before the simulation.
        self.request.robot_model.truth(self.scenario.real_robot, self.scenario.friction)

    def require_bearable(self, yes: bool) -> None:
        """Say how long a simulation is that takes long; raise ExperimentError if it would hardly end, unless that is wanted."""
        h = self.scenario.drive.step_length(self.scenario.fs, self.scenario.physics.step)
        steps = self.scenario.trajectory.motion(self.scenario.real_robot).duration / h
        size = f"{steps:.1e} physics steps of {h:.2g} s"
        if steps > ENDLESS and not yes:
            raise ExperimentError(f"scenario {self.scenario.name} makes {size}: hours or days; if you mean it, add --yes")
        if steps > LONG:
            sys.stderr.write(f"idbench: {size} are to be simulated, some tens of thousands a second\n")

    @cached_property
    def run(self) -> Run:
        """The simulation."""
        return simulate(self.scenario, progress=self.progress, watch=self.watch)

    @cached_property
    def fit(self) -> Fit:
        """What the models make of its log."""
        robot, friction = self.run.robots[0], self.scenario.friction
        truth, log = self.request.robot_model.truth(robot, friction), self.run.alone()
        truth |= friction.truth(robot) | self.scenario.ripple.truth(robot)
        if not np.any(log.tau):
            step = max(self.scenario.torque.resolution)
            coarse = (
                f"torque.resolution = {step:g} N m is coarser than all of them: give a smaller one, or 0 for an exact converter"
            )
            why = coarse if step else "nothing acts on the joints"
            raise ExperimentError(f"scenario {self.scenario.name}: all torques of the log are 0: {why}")
        return fit(replace(self.request, loops=(self.scenario,)), Logs((log,), truth=truth))

    @cached_property
    def rejection(self) -> Rejection | None:
        """What the loop commands against the ripple of the drives; none without ripple, or if a plug-in's controller fails."""
        try:
            return rejection(self.run) if self.scenario.ripple != Ripple() else None
        except BaseException as error:  # whatever a plug-in raises: the fit is not lost by it
            if not is_mistake(error):
                raise
            return None

    def conclusion(self, folder: str) -> Conclusion:
        """The largest error of the leading model, and how to go on with the results in a folder."""
        fit = self.fit
        found, truth = fit.estimates[fit.leading], fit.truth or {}
        known = [(abs(100 * (x / true - 1)), abs(x - true) / sigma, name)
                 for name, x, sigma in zip(found.names, found.X.tolist(), found.standard_errors.tolist(), strict=True)
                 if (true := truth.get(name))]  # fmt: skip
        off, z, name = max(known, default=(0.0, 0.0, ""))
        finding = f"largest error {off:.2g} % ({name}, {z:.2g} sigma)" if name else "no parameter has a true value"
        option = remedy_of(fit.diagnosis) if fit.diagnosis and fit.diagnosis[0].remedy else ""
        step = f"{program()} identify {folder} {option}" if option else f"{program()} view {folder}"
        return Conclusion("", f"Result: {fit.leading} model: {finding}", step)

    def summary(self) -> dict[str, Any]:
        """Return summary.json."""
        return {
            "experiment": "run",
            "seed": self.scenario.seed,
            "scenario": to_dict(self.scenario),
            **self.fit.summary(),
            "further_truth": {name: x for name, x in (self.fit.logs.truth or {}).items() if name not in self.fit.basis.names},
            "iterations": iterations(self.fit),
            **({} if self.rejection is None else {"rejection_rms": self.rejection.rejected.std(axis=0).tolist()}),
        }
