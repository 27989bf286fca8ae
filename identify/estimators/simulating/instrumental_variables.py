"""Instrumental variables."""

from dataclasses import dataclass
from typing import ClassVar

from idbench.identify.arrays import Array
from idbench.identify.estimators.estimate import Estimate
from idbench.identify.estimators.estimator import Need
from idbench.identify.estimators.problem import Problem
from idbench.identify.estimators.simulating.residual_scatter import scatter
from idbench.identify.estimators.simulating.row_products import Kinds, Solved, solve_with
from idbench.identify.estimators.simulating.simulated_rounds import AbstractSimulating, rates
from idbench.identify.estimators.simulating.steps import SecantSteps
from idbench.identify.estimators.solution import Given


@dataclass(frozen=True)
class DirectInverse(AbstractSimulating):
    """Direct and inverse dynamic identification (DIDIM): least squares of the measured torques on the simulated robot's rows.

    The robot with the parameters of the round before is simulated in its closed loop; measured positions take no part. The rows
    of both have the mask of the log. It makes the simulated torques those of the log, as CLIE does, with one simulation a round
    (M. Gautier, A. Janot and P.-O. Vandanjon, "A new closed-loop output error method for parameter identification of robot
    dynamics", IEEE Trans. Control Systems Technology 21 (2013) 428-444). A wrong controller in the simulation makes it wrong.
    """

    settled: float = 0.1
    acronym: ClassVar[str] = "DIDIM"
    needs: ClassVar[frozenset[Need]] = frozenset({"rows", "loop"})

    def solve(self, problem: Problem) -> Estimate:
        """Return the estimate of every run."""
        rounds = self.begun(problem)
        rows = problem.rows
        kinds = Kinds.of_rows(problem)

        def step(X: Array) -> Solved:
            W = problem.at(rounds.simulated(X).logs).W
            return solve_with(kinds, rows.Y, W, W)

        found = rounds.until_settled(step, rounds.start(), SecantSteps())
        return rounds.estimate(found, calibrated=scatter(found, kinds, rates(problem)))


@dataclass(frozen=True)
class InstrumentalVariables(AbstractSimulating):
    """Instrumental variables (IDIM-IV), X = (Z' w^2 W)^-1 Z' w^2 Y, with Z the rows of the simulated robot.

    The robot with the parameters of the round before is simulated in its closed loop, without noise: the rows Z of its motion
    are those of the log, but for the log's noise. So noise of the positions in W leaves no bias (A. Janot, P.-O. Vandanjon and
    M. Gautier, "A generic instrumental variable approach for industrial robot identification", IEEE Trans. Control Systems
    Technology 22 (2014) 132-145). A wrong controller in the simulation makes the estimate less sure, not wrong; so do laws of
    friction that the simulated robot does not have.
    """

    settled: float = 0.1
    acronym: ClassVar[str] = "IV"
    needs: ClassVar[frozenset[Need]] = frozenset({"rows", "loop"})

    def solve(self, problem: Problem) -> Estimate:
        """Return the estimate of every run."""
        rounds = self.begun(problem, exact=False)
        rows = problem.rows
        kinds = Kinds.of_rows(problem)

        def step(X: Array) -> Solved:
            return solve_with(kinds, rows.Y, rows.W, problem.at(rounds.simulated(X).logs).W)

        found = rounds.until_settled(step, rounds.start(), SecantSteps())
        return rounds.estimate(found, solution=Given(found.G))
