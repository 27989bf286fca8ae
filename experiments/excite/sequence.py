"""Motions one after the other, each designed for what the logs before it left open, on the simulated robot."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from rich.console import Console
from rich.text import Text

from experiments.errors import ExperimentError
from experiments.excite.design import Design
from experiments.excite.excited import Excited
from experiments.text import new_table, print_titled
from identify import Array, Estimate, ExplicitModel, MotionLog, brisk_shares, identify
from sim.engine.simulation import Progress, simulate

ENOUGH = 0.1
"""Weight of a parameter that is known well enough."""

ROUNDS = 12
"""Motions after which a wish counts as out of reach."""


@dataclass(frozen=True, eq=False)
class Round:
    """A motion, its log, and what all logs so far say.

    Parameters
    ----------
    excited : Excited
        The motion.
    log : MotionLog
        What was logged.
    estimate : Estimate
        Parameters from all logs so far.
    shares : Array, shape (p,)
        What one sigma of each parameter makes of a brisk motion's torque.
    """

    excited: Excited
    log: MotionLog
    estimate: Estimate
    shares: Array

    @property
    def share(self) -> float:
        """The largest of the shares."""
        return float(self.shares.max())

    @property
    def weakest(self) -> str:
        """The parameter that has it."""
        return self.excited.design.subject.basis.names[int(self.shares.argmax())]


@dataclass(frozen=True, eq=False)
class Sequence:
    """Motions until every parameter is known well enough.

    Parameters
    ----------
    rounds : tuple of Round
        One a motion.
    wished : float
        Share that was asked for.
    """

    rounds: tuple[Round, ...]
    wished: float

    @classmethod
    def of(cls, design: Design, wished: float, progress: Progress | None = None) -> "Sequence":
        """Design, simulate and identify until one sigma of each parameter makes less than `wished` of a brisk torque.

        Raises
        ------
        ExperimentError
            If so many motions do not reach it.
        """
        rounds, logs = list[Round](), design.logs
        for number in range(ROUNDS):
            weights = _weak(rounds[-1], wished) if rounds else design.weights
            excited = Excited.of(replace(design, logs=logs, seed=design.seed + number, weights=weights), progress)
            run = simulate(replace(excited.scenario, seed=design.scenario.seed + number))
            logs = (*logs, run.alone())
            rounds.append(_judged(excited, logs))
            if rounds[-1].share < wished or excited.interrupted:
                return cls(tuple(rounds), wished)
        raise ExperimentError(
            f"after {ROUNDS} motions one sigma of {rounds[-1].weakest} makes {rounds[-1].share:.2%} of a brisk torque, not "
            f"less than {wished:.2%}: give a longer --duration, less noise, or a higher --until"
        )

    @property
    def last(self) -> Excited:
        """The last motion."""
        return self.rounds[-1].excited

    @property
    def logs(self) -> list[MotionLog]:
        """The logs, one a motion."""
        return [each.log for each in self.rounds]

    def summary(self) -> dict[str, Any]:
        """Return what summary.json has of it."""
        return {"until": self.wished, "rounds": [_summary(each) for each in self.rounds]}


def _summary(found: Round) -> dict[str, Any]:
    X, sigma = found.estimate.X.tolist(), found.estimate.best_sigma.tolist()
    return {"brisk_share": found.share, "weakest": found.weakest, "estimate": X, "sigma": sigma}


def _judged(excited: Excited, logs: tuple[MotionLog, ...]) -> Round:
    subject = excited.design.subject
    estimate = identify(logs, subject.basis, ExplicitModel())
    shares = brisk_shares(subject.tree, subject.basis, estimate.X, estimate.best_sigma)
    return Round(excited, logs[-1], estimate, shares)


def _weak(last: Round, wished: float) -> dict[str, float]:
    """Return weights for the next motion: what is not known well enough counts as much more as it is off."""
    names = last.excited.design.subject.basis.names
    return {name: float(max(ENOUGH, share / wished)) for name, share in zip(names, last.shares, strict=True)}


def print_sequence(console: Console, sequence: Sequence) -> None:
    """Print what each motion left open."""
    grid = new_table("", ["weakest\nparameter", "its sigma, of\nbrisk torque %", "typical\nsigma, of first"])
    first = np.log(sequence.rounds[0].estimate.best_sigma).mean()
    for number, each in enumerate(sequence.rounds, 1):
        typical = np.exp(np.log(each.estimate.best_sigma).mean() - first)
        grid.add_row(f"motion {number}", each.weakest, f"{100 * each.share:.3g}", f"{typical:.2f}")
    print_titled(console, "motions one after the other, identified together", grid)
    console.print(Text(f"every sigma makes less than {sequence.wished:.2%} of a brisk torque"))
