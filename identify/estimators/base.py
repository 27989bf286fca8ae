"""What an estimator is, and what it is given."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import ClassVar, Literal, final

from identify.arrays import Array
from identify.errors import IdentificationError
from identify.estimate import Estimate
from identify.motion_log import MotionLog
from identify.system import System

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
    def fit(self, problem: Problem) -> Estimate:
        """Return the estimate of `problem`.

        Raises
        ------
        IdentificationError
            If the problem lacks what this estimator needs.
        """
        for need in sorted(self.needs):
            if getattr(problem, need) is None:
                raise IdentificationError(f"{type(self).__name__} needs a way to {need}, which the caller did not give")
        return self.solve(problem)
