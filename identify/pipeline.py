"""The verbs of the package."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial

from identify.arrays import Array
from identify.basis import Basis
from identify.blame import blamed
from identify.chain import Chain, idbench_chain
from identify.errors import IdentificationError
from identify.estimate import Estimate
from identify.estimators import AbstractEstimator, Problem, WeightedLeastSquares
from identify.long import build_long, is_long, sampled
from identify.models import AbstractModel, ExplicitModel
from identify.motion_log import MotionLog
from identify.noise import torque_noise
from identify.system import System

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
    found = attempt_each(log, basis, models, chain, estimator, simulate=simulate, throw=throw)
    for outcome in found.values():
        if isinstance(outcome, IdentificationError):
            raise outcome
    return {name: outcome for name, outcome in found.items() if isinstance(outcome, Estimate)}


def attempt_each(
    log: MotionLog | Sequence[MotionLog],
    basis: Basis,
    models: Mapping[str, AbstractModel],
    chain: Chain | None = None,
    estimator: AbstractEstimator | None = None,
    *,
    simulate: Callable[[Array], MotionLog] | None = None,
    throw: bool = True,
) -> dict[str, Estimate | IdentificationError]:
    """Identify with several models; return the estimate of each, or the reason why it has none: each stands or falls alone.

    Parameters are those of `identify_each`. With `throw` false, runs that cannot be solved are told by their status alone.

    Raises
    ------
    IdentificationError
        If the log or a setting allows no model an estimate.
    """
    chain, estimator = chain or idbench_chain(), estimator or WeightedLeastSquares()
    _require(log, Sequence, "a MotionLog or a sequence of them, such as read_log(path)", MotionLog)
    _require(basis, Basis, "a Basis, such as scara()")
    _require(chain, Chain, 'a Chain, such as CHAINS.create("paper")')
    _require(estimator, AbstractEstimator, 'an estimator, such as ESTIMATORS.create("OLS")')
    for model in models.values():
        _require(model, AbstractModel, 'a model, such as MODELS.create("power")')

    def solved(model: AbstractModel, system: System, throw: bool) -> Estimate:
        if throw and estimator.full_rank:
            system.check()
        with blamed():
            return estimator.fit(Problem(system, partial(chain.build, basis=basis, model=model), simulate), throw=throw)

    def fit(systems: Sequence[System], throw: bool) -> dict[str, Estimate | IdentificationError]:
        pairs = zip(models.items(), systems, strict=True)
        return {name: _outcome(solved, model, system, throw) for (name, model), system in pairs}

    given = list(models.values())
    if not is_long(log):
        return fit(_systems(chain, log, basis, given), throw)
    with blamed():
        systems = build_long(chain, log, basis, given)
    whole = fit(systems, throw)
    some = fit(_systems(chain, sampled(chain, log, SAMPLED), basis, given), False)
    return {name: _corrected(outcome, some[name]) for name, outcome in whole.items()}


def _outcome(
    solve: Callable[[AbstractModel, System, bool], Estimate], model: AbstractModel, system: System, throw: bool
) -> Estimate | IdentificationError:
    try:
        return solve(model, system, throw)
    except IdentificationError as error:
        return error


def _corrected(whole: Estimate | IdentificationError, part: Estimate | IdentificationError) -> Estimate | IdentificationError:
    """Return the estimate of a long log, its sigma corrected as that of a part of it is."""
    if isinstance(whole, IdentificationError) or isinstance(part, IdentificationError):
        return whole
    return replace(whole, correction=part.corrected_sigma / part.sigma)


def _systems(chain: Chain, log: MotionLog | Sequence[MotionLog], basis: Basis, models: Sequence[AbstractModel]) -> list[System]:
    """Return the rows of each model, which know the noise of the torques."""
    with blamed():
        *systems, explicit = chain.build_each(log, basis, [*models, ExplicitModel()])
    levels = torque_noise(explicit)
    return [replace(rows, levels=levels) for rows in systems]


def _require(given: object, kind: type, wanted: str, *others: type) -> None:
    """Raise IdentificationError unless `given` is an object of the kind: names, paths and classes are likely slips."""
    if not isinstance(given, (kind, *others)) or isinstance(given, (str, bytes)):
        raise IdentificationError(f"{given!r:.60} is given where {wanted} is needed")
