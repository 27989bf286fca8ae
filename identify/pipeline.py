"""The verbs of the package."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial

from identify.arrays import Array
from identify.basis import Basis
from identify.chain import Chain, idbench_chain
from identify.errors import IdentificationError
from identify.estimate import Estimate
from identify.estimators import AbstractEstimator, Problem, WeightedLeastSquares
from identify.long import build_long, is_long, sampled
from identify.models import AbstractModel, ExplicitModel
from identify.motion_log import MotionLog
from identify.noise import torque_noise

SAMPLED = 8
"""Pieces of a long log from which the correction of sigma is taken."""


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
        Weighted least squares by default.
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
    return identify_each(log, basis, {"": model}, chain, estimator, simulate=simulate, throw=throw)[""]


def identify_each(
    log: MotionLog | Sequence[MotionLog],
    basis: Basis,
    models: Mapping[str, AbstractModel],
    chain: Chain | None = None,
    estimator: AbstractEstimator | None = None,
    *,
    simulate: Callable[[Array], MotionLog] | None = None,
    throw: bool = True,
) -> dict[str, Estimate]:
    """Identify with several models, by name, from the same filtered signals; otherwise as `identify`."""
    chain, estimator = chain or idbench_chain(), estimator or WeightedLeastSquares()
    _require(log, Sequence, "a MotionLog or a sequence of them, such as read_log(path)", MotionLog)
    _require(basis, Basis, "a Basis, such as scara()")
    _require(chain, Chain, 'a Chain, such as CHAINS.create("paper")')
    _require(estimator, AbstractEstimator, 'an estimator, such as ESTIMATORS.create("OLS")')
    for model in models.values():
        _require(model, AbstractModel, 'a model, such as MODELS.create("power")')
    way = _identify_long if is_long(log) else _identify_rows
    return way(log, basis, models, chain, estimator, simulate, throw=throw)


def _identify_rows(
    log: MotionLog | Sequence[MotionLog],
    basis: Basis,
    models: Mapping[str, AbstractModel],
    chain: Chain,
    estimator: AbstractEstimator,
    simulate: Callable[[Array], MotionLog] | None = None,
    *,
    throw: bool,
) -> dict[str, Estimate]:
    """Return the estimates from all rows."""
    *systems, explicit = chain.build_each(log, basis, [*models.values(), ExplicitModel()])
    levels = torque_noise(explicit)
    estimates = {}
    for (name, model), rows in zip(models.items(), systems, strict=True):
        problem = Problem(replace(rows, levels=levels), partial(chain.build, basis=basis, model=model), simulate)
        estimates[name] = _fitted(problem, estimator, throw=throw)
    return estimates


def _identify_long(
    log: MotionLog | Sequence[MotionLog],
    basis: Basis,
    models: Mapping[str, AbstractModel],
    chain: Chain,
    estimator: AbstractEstimator,
    simulate: Callable[[Array], MotionLog] | None = None,
    *,
    throw: bool,
) -> dict[str, Estimate]:
    """Return the estimates of a log whose rows are not kept; some of its pieces tell how sigma is to be corrected."""
    systems = build_long(chain, log, basis, list(models.values()))
    some = _identify_rows(sampled(chain, log, SAMPLED), basis, models, chain, estimator, throw=False)
    estimates = {}
    for (name, model), system in zip(models.items(), systems, strict=True):
        problem = Problem(system, partial(chain.build, basis=basis, model=model), simulate)
        correction = some[name].corrected_sigma / some[name].sigma
        estimates[name] = replace(_fitted(problem, estimator, throw=throw), correction=correction)
    return estimates


def _fitted(problem: Problem, estimator: AbstractEstimator, *, throw: bool) -> Estimate:
    if throw and estimator.full_rank:
        problem.system.check()
    return estimator.fit(problem)


def _require(given: object, kind: type, wanted: str, *others: type) -> None:
    """Raise IdentificationError unless `given` is an object of the kind: names, paths and classes are likely slips."""
    if not isinstance(given, (kind, *others)) or isinstance(given, (str, bytes)):
        raise IdentificationError(f"{given!r:.60} is given where {wanted} is needed")
