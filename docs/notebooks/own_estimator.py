"""
# An estimator of your own, compared with others

An estimator is one class with one function. A study runs it over a grid of simulated robots whose truth is known.
"""

from dataclasses import dataclass

import numpy as np

from idbench.identify import AbstractEstimator, Estimate


@dataclass(frozen=True)
class Ridge(AbstractEstimator):
    """Least squares with a penalty on the size of the parameters: X = (W' W + strength I)^-1 W' Y."""

    strength: float = 1e-6

    def solve(self, problem):
        """Return the estimate of every run."""
        W, Y = problem.rows.W, problem.rows.Y
        Wt = np.swapaxes(W, -1, -2)
        A = Wt @ W + self.strength * np.eye(W.shape[-1])
        return Estimate.judge(problem, np.linalg.solve(A, Wt @ Y[..., None])[..., 0])


"""
## On one log
"""

import idbench

run = idbench.simulate("quantization", seed=1)
idbench.fit(run.log, run.robot, model="explicit", estimator=Ridge(), truth=run.truth)

"""
## In a study

Names and objects may stand side by side; settings of an object tell it from others of its class.
"""

table = idbench.study("encoder", seeds=4, chains=["idbench"], models=["explicit"], estimators=["WLS", "GLS", Ridge()])
table

"""
The typical error of each combination, as numbers:
"""

for (lines, chain, estimator, model), error in table.typical_errors().items():
    print(f"{lines:>6} lines, {estimator:6} {100 * error:.2g} %")
