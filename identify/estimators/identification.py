"""From logs to estimates: what users call."""

from collections.abc import Mapping, Sequence

from idbench.identify.basis.basis import Basis
from idbench.identify.blame import blamed
from idbench.identify.data.motion_log import MotionLog
from idbench.identify.errors import IdentificationError
from idbench.identify.estimators.estimate import Estimate
from idbench.identify.estimators.estimator import AbstractEstimator
from idbench.identify.estimators.least_squares.ordinary_weighted_generalized import GeneralizedLeastSquares
from idbench.identify.estimators.problem import Problem
from idbench.identify.estimators.settle import settled
from idbench.identify.estimators.simulator import Simulation
from idbench.identify.models import AbstractModel, ExplicitModel
from idbench.identify.rows.chain import Chain, idbench_chain
from idbench.identify.telling import one_thread, stage


def identify(
    log: MotionLog | Sequence[MotionLog],
    basis: Basis,
    model: AbstractModel,
    chain: Chain | None = None,
    estimator: AbstractEstimator | None = None,
    *,
    simulation: Simulation | None = None,
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
        Generalized least squares by default.
    simulation : Simulation, optional
        How the robot is simulated, for estimators that need it.
    throw : bool
        Raise if a run cannot be solved; otherwise `status` reports it.

    Returns
    -------
    Estimate
        Parameters, their uncertainty and the quality of the fit.

    Raises
    ------
    IdentificationError
        If the log, a setting, or the motion does not allow an estimate; the message says what to try.

    Examples
    --------
    >>> from idbench.identify import MODELS, identify, scara
    >>> from idbench.sim import load_scenario, run
    >>> log = run(load_scenario("ideal")).alone()
    >>> estimate = identify(log, scara(), MODELS.create("explicit"))
    >>> estimate.names[0], round(float(estimate.X[0]), 3), bool(estimate.standard_errors[0] < 1e-3)
    ('ZZR1', 3.5, True)
    """
    _require(model, AbstractModel, 'a model, such as MODELS.create("power")')
    problem = _problem(log, basis, model, chain, simulation)
    return estimate(problem, estimator or GeneralizedLeastSquares(), throw=throw)


def identify_each(
    log: MotionLog | Sequence[MotionLog],
    basis: Basis,
    models: Mapping[str, AbstractModel],
    chain: Chain | None = None,
    estimator: AbstractEstimator | None = None,
    *,
    simulation: Simulation | None = None,
    throw: bool = True,
) -> dict[str, Estimate]:
    """Identify with several models, by name, from the same signals; otherwise as `identify`.

    Examples
    --------
    >>> from idbench.identify import MODELS, identify_each, scara
    >>> from idbench.sim import load_scenario, run
    >>> log = run(load_scenario("ideal")).alone()
    >>> models = {name: MODELS.create(name) for name in ("explicit", "power")}
    >>> [round(float(each.X[2]), 2) for each in identify_each(log, scara(), models).values()]
    [0.5, 0.5]
    """
    found = attempt_each(_problem(log, basis, ExplicitModel(), chain, simulation), models, estimator, throw=throw)
    for outcome in found.values():
        if isinstance(outcome, IdentificationError):
            raise outcome
    return {name: outcome for name, outcome in found.items() if isinstance(outcome, Estimate)}


def attempt_each(
    problem: Problem, models: Mapping[str, AbstractModel], estimator: AbstractEstimator | None = None, *, throw: bool = True
) -> dict[str, Estimate | IdentificationError]:
    """Identify with several models; return the estimate of each, or why it has none: one does not take the others' away.

    Parameters
    ----------
    problem : Problem
        Logs, robot and chain, of any model.
    models : mapping of str to AbstractModel
        The models, by name.
    estimator : AbstractEstimator, optional
        Generalized least squares by default.
    throw : bool
        Raise if a run cannot be solved; otherwise the estimates' `status` says it.

    Raises
    ------
    IdentificationError
        If the log or a setting allows no model an estimate.
    """
    _require(problem, Problem, "a Problem, such as Problem((log,), basis, model, chain)")
    estimator = estimator or GeneralizedLeastSquares()
    _require(estimator, AbstractEstimator, 'an estimator, such as ESTIMATORS.create("OLS")')
    for model in models.values():
        _require(model, AbstractModel, 'a model, such as MODELS.create("power")')
    problems = {name: problem.with_model(model) for name, model in models.items()}
    with one_thread(), blamed():  # what one model's rows lack, such as the joints of the basis, all lack
        for name, each in problems.items():
            with stage(f"rows of the {name} model"):
                _ = each.some_rows
    for signals in problem.signals:
        signals.state.forget()
    found = dict[str, Estimate | IdentificationError]()
    for number, (name, each) in enumerate(problems.items(), 1):
        with stage(f"{name} model, {estimator.called} ({number} of {len(problems)})"):
            try:
                found[name] = estimate(each, estimator, throw=throw)
            except IdentificationError as error:
                found[name] = error
    problem.forget()
    return found


def estimate(problem: Problem, estimator: AbstractEstimator, *, throw: bool = True) -> Estimate:
    """Return the estimate of a problem; with `throw`, raise if a run cannot be solved, otherwise `status` reports it."""
    _require(estimator, AbstractEstimator, 'an estimator, such as ESTIMATORS.create("OLS")')
    with one_thread(), blamed():
        estimator.require(problem)
        if throw and estimator.full_rank and not problem.long:  # of long logs it is reported as they are solved
            problem.factors.together.check()
        return estimator.fit(problem, throw=throw)


def _problem(
    log: MotionLog | Sequence[MotionLog], basis: Basis, model: AbstractModel, chain: Chain | None, simulation: Simulation | None
) -> Problem:
    chain = chain or idbench_chain()
    _require(log, Sequence, "a MotionLog or a sequence of them, such as read_log(path)", MotionLog)
    _require(basis, Basis, "a Basis, such as scara()")
    _require(chain, Chain, 'a Chain, such as CHAINS.create("paper")')
    with blamed():
        return settled(
            Problem((log,) if isinstance(log, MotionLog) else tuple(log), basis, model, chain, simulation or Simulation())
        )


def _require(given: object, kind: type, wanted: str, *others: type) -> None:
    """Raise IdentificationError unless `given` is an object of the kind: names, paths and classes are likely slips."""
    if not isinstance(given, (kind, *others)) or isinstance(given, (str, bytes)):
        raise IdentificationError(f"{given!r:.60} is given where {wanted} is needed")
