"""The verb of the package."""

from collections.abc import Callable, Sequence

from identify.arrays import Array
from identify.basis import Basis
from identify.chain import Chain, idbench_chain
from identify.estimate import Estimate
from identify.estimators import AbstractEstimator, OrdinaryLeastSquares, Problem
from identify.models import AbstractModel
from identify.motion_log import MotionLog


def identify(
    log: MotionLog | Sequence[MotionLog],
    basis: Basis,
    model: AbstractModel,
    chain: Chain | None = None,
    estimator: AbstractEstimator | None = None,
    *,
    simulate: Callable[[Array], MotionLog] | None = None,
    throw: bool = True,
) -> Estimate:
    """Identify the parameters of a robot.

    Parameters
    ----------
    log : MotionLog or sequence of MotionLog
        What the robot logged. Leading axes are identified run by run; a sequence is one fit.
    basis : Basis
        The robot, linear in its parameters.
    model : AbstractModel
        Explicit, implicit or power.
    chain : Chain, optional
        Signal processing; chain `idbench` by default.
    estimator : AbstractEstimator, optional
        Ordinary least squares by default.
    simulate : callable, optional
        Simulates the robot with given parameters, for estimators that need it.
    throw : bool
        Raise if a run cannot be solved; otherwise its `system.status` tells.

    Returns
    -------
    Estimate
        Parameters, their uncertainty and the quality of the fit.

    Raises
    ------
    IdentificationError
        If the log, a setting, or the motion does not allow an estimate; the message says what to try.
    """
    chain = chain or idbench_chain()
    system = chain.build(log, basis, model)
    problem = Problem(system, rebuild=lambda other: chain.build(other, basis, model), simulate=simulate)
    if throw:
        system.check()
    return (estimator or OrdinaryLeastSquares()).fit(problem)
