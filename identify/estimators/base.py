"""What an estimator is, and what it is given."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import ClassVar, Literal, final

import numpy as np

from identify.arrays import Array
from identify.blame import expect
from identify.errors import IdentificationError, PluginError
from identify.estimate import Estimate
from identify.motion_log import MotionLog
from identify.system import Status, System

Need = Literal["rebuild", "simulate"]


@dataclass(frozen=True, eq=False)
class Problem:
    """All that an estimator may ask for.

    Parameters
    ----------
    system : System
        Y = W X + rho.
    rebuild : callable, optional
        Makes the system of another log, or of several, with the same chain, basis and model (instrumental variables).
    simulate : callable, optional
        Makes the log of a robot with the parameters X that repeats the motion (output error, DIDIM).
    """

    system: System
    rebuild: Callable[[MotionLog | Sequence[MotionLog]], System] | None = None
    simulate: Callable[[Array], MotionLog] | None = None


class AbstractEstimator(ABC):
    """Turns a problem into an estimate of X."""

    needs: ClassVar[frozenset[Need]] = frozenset()
    """What it needs beside the system."""

    full_rank: ClassVar[bool] = True
    """Whether it needs a motion that shows every parameter; one with a prior or a penalty does not."""

    @abstractmethod
    def solve(self, problem: Problem) -> Estimate:
        """Return the estimate of `problem`, every run by itself."""

    @final
    def fit(self, problem: Problem, *, throw: bool = True) -> Estimate:
        """Return the estimate of `problem`, checked.

        Raises
        ------
        IdentificationError
            If the problem lacks what this estimator needs; with `throw`, if it finds no finite value for a parameter.
        PluginError
            If it returns something else than an estimate of all parameters.
        """
        for need in sorted(self.needs):
            if getattr(problem, need) is None:
                raise IdentificationError(f"{type(self).__name__} needs a way to {need}, which the caller did not give")
        estimate, system = self.solve(problem), problem.system
        if not isinstance(estimate, Estimate):
            raise PluginError(f"plug-in {type(self).__name__}.solve returned {estimate!r:.60}, expected an Estimate")
        expect(self, "solve", estimate.X, (*system.Y.shape[:-1], len(system.parameters)))
        lost = ~np.isfinite(estimate.X) & (system.status == Status.OK)[..., None]
        if throw and lost.any():
            names = ", ".join(np.array(system.parameters)[lost.reshape(-1, len(system.parameters)).any(axis=0)])
            raise IdentificationError(f"{type(self).__name__} finds no finite value for {names}")
        return estimate
