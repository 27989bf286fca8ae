"""Motions one after the other, each designed for what the logs before it left open, on the simulated robot."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from rich.console import Console
from rich.text import Text

from experiments.excite.design import Design
from experiments.excite.excited import Excited
from experiments.text import new_table, print_titled
from identify import Array, Estimate, ExplicitModel, MotionLog, brisk_shares, identify
from sim.engine.simulation import Progress, simulate

ENOUGH = 0.1
"""Weight of a parameter that is known well enough."""

ROUNDS = 12
"""Motions after which it ends, whatever is known."""


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
class MotionSequence:
    """Motions until every parameter is known well enough.

    Parameters
    ----------
    rounds : tuple of Round
        One a motion.
    wished : float
        Share that was asked for.
    interrupted : bool
        Whether it was ended before its time.
    """

    rounds: tuple[Round, ...]
    wished: float
    interrupted: bool = False

    @classmethod
    def of(cls, design: Design, wished: float, progress: Progress | None = None) -> "MotionSequence":
        """Design, simulate and identify until one sigma of each parameter makes less than `wished` of a brisk torque.

        After ROUNDS motions, or Ctrl-C, it ends with what there is.
        """
        rounds, logs, weights = list[Round](), design.logs, design.weights
        try:
            for number in range(ROUNDS):
                asked = replace(design, logs=logs, seed=design.seed + number, weights=weights)
                excited = Excited.of(asked, progress)
                run = simulate(replace(excited.scenario, seed=design.scenario.seed + number))
                logs = (*logs, run.alone())
                rounds.append(_judged(excited, logs))
                if rounds[-1].share < wished or excited.interrupted:
                    break
                weights = _weak(rounds[-1], wished, design.weights)
        except KeyboardInterrupt:
            if not rounds:
                raise
            return cls(tuple(rounds), wished, interrupted=True)
        return cls(tuple(rounds), wished, rounds[-1].excited.interrupted)

    @property
    def reached(self) -> bool:
        """Whether every parameter is known well enough."""
        return self.rounds[-1].share < self.wished

    @property
    def last(self) -> Excited:
        """The last motion."""
        return self.rounds[-1].excited

    def summary(self) -> dict[str, Any]:
        """Return what summary.json has of it."""
        return {"until": self.wished, "reached": self.reached, "rounds": [_summary(each) for each in self.rounds]}


def _summary(found: Round) -> dict[str, Any]:
    X, sigma = found.estimate.X.tolist(), found.estimate.best_sigma.tolist()
    return {"brisk_share": found.share, "weakest": found.weakest, "estimate": X, "sigma": sigma}


def _judged(excited: Excited, logs: tuple[MotionLog, ...]) -> Round:
    subject = excited.design.subject
    estimate = identify(logs, subject.basis, ExplicitModel())
    shares = brisk_shares(subject.tree, subject.basis, estimate.X, estimate.best_sigma)
    return Round(excited, logs[-1], estimate, shares)


def _weak(last: Round, wished: float, weights: Mapping[str, float]) -> dict[str, float]:
    """Return weights for the next motion: what is not known well enough counts as much more as it is off."""
    names = last.excited.design.subject.basis.names
    each = zip(names, last.shares, strict=True)
    return {name: float(weights.get(name, 1.0) * max(ENOUGH, share / wished)) for name, share in each}


def print_sequence(console: Console, sequence: MotionSequence) -> None:
    """Print what each motion left open."""
    grid = new_table("", ["weakest\nparameter", "its sigma, of\nbrisk torque %", "typical\nsigma, of first"])
    first = np.log(sequence.rounds[0].estimate.best_sigma).mean()
    for number, each in enumerate(sequence.rounds, 1):
        typical = np.exp(np.log(each.estimate.best_sigma).mean() - first)
        grid.add_row(f"motion {number}", each.weakest, f"{100 * each.share:.3g}", f"{typical:.2f}")
    print_titled(console, "motions one after the other, identified together", grid)
    last = sequence.rounds[-1]
    reached = f"every sigma makes less than {100 * sequence.wished:.4g} % of a brisk torque"
    why = "interrupted; go on with --log" if sequence.interrupted else "give a longer --duration, or less noise"
    short = f"not reached after {len(sequence.rounds)} motions: {last.weakest} still makes {last.share:.2%}; {why}"
    console.print(Text(reached if sequence.reached else short), soft_wrap=True)
