"""Motions one after the other, each designed for what the logs before it left open, on the simulated robot."""

from dataclasses import dataclass, replace
from typing import Any

from idbench.experiments.excite.design import Design
from idbench.experiments.excite.excited import Excited
from idbench.identify import Array, Estimate, ExplicitModel, MotionLog, brisk_shares, identify
from idbench.sim.engine.simulation import Progress, simulate

ENOUGH = 0.1  # Weight of a parameter that is known well enough
ROUNDS = 12  # Motions after which it ends, whatever is known


@dataclass(frozen=True, eq=False)
class Round:
    """A motion, its log, and what all logs so far say."""

    excited: Excited
    """The motion."""
    log: MotionLog
    """What was logged."""
    estimate: Estimate
    """Parameters from all logs so far."""
    shares: Array
    """What one sigma of each parameter makes of a brisk motion's torque, shape (p,)."""

    @property
    def share(self) -> float:
        """The largest of the shares."""
        return float(self.shares.max())

    @property
    def weakest(self) -> str:
        """The parameter that has it."""
        return self.excited.design.robot_model.basis.names[int(self.shares.argmax())]


@dataclass(frozen=True, eq=False)
class MotionSequence:
    """Motions until every parameter is known well enough."""

    rounds: tuple[Round, ...]
    """One a motion."""
    wished: float
    """Share that was asked for."""
    interrupted: bool = False
    """Whether it was ended before its time."""

    @classmethod
    def of(cls, design: Design, wished: float, progress: Progress | None = None) -> "MotionSequence":
        """Design, simulate and identify until one sigma of each parameter makes less than `wished` of a brisk torque.

        After ROUNDS motions, or Ctrl-C, it ends with what there is.
        """
        rounds, weights = list[Round](), design.weights
        logs, model = design.logs, design.robot_model
        try:
            for number in range(ROUNDS):
                excited = Excited.of(replace(design, logs=logs, seed=design.seed + number, weights=weights), progress)
                logs = (*logs, simulate(replace(excited.scenario, seed=design.scenario.seed + number)).alone())
                estimate = identify(logs, model.basis, ExplicitModel())
                shares = brisk_shares(model.tree, model.basis, estimate.X, estimate.standard_errors)
                rounds.append(Round(excited, logs[-1], estimate, shares))
                if rounds[-1].share < wished or excited.interrupted:
                    break
                each = zip(model.basis.names, shares, strict=True)  # what is not known well enough counts as much more
                weights = {name: float(design.weights.get(name, 1.0) * max(ENOUGH, x / wished)) for name, x in each}
        except KeyboardInterrupt:
            if not rounds:
                raise
            return cls(tuple(rounds), wished, interrupted=True)
        return cls(tuple(rounds), wished, rounds[-1].excited.interrupted)

    @property
    def reached(self) -> bool:
        """Whether every parameter is known well enough."""
        return self.rounds[-1].share < self.wished

    def summary(self) -> dict[str, Any]:
        """Its part of summary.json."""
        return {"until": self.wished, "reached": self.reached, "rounds": [_summary(each) for each in self.rounds]}


def _summary(found: Round) -> dict[str, Any]:
    X, sigma = found.estimate.X.tolist(), found.estimate.standard_errors.tolist()
    return {"brisk_share": found.share, "weakest": found.weakest, "estimate": X, "sigma": sigma}
