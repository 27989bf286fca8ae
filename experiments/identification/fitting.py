"""Logs become a fit: laws and masks that suit them, parameters that they show, torques that were logged."""

from dataclasses import replace

import numpy as np

from idbench.experiments.identification.causes import causes_of
from idbench.experiments.identification.fit import Fit
from idbench.experiments.identification.friction_choice import chosen_in_turns, hidden_laws
from idbench.experiments.identification.friction_laws import said
from idbench.experiments.identification.logs import Logs
from idbench.experiments.identification.prior_share import chosen_share
from idbench.experiments.identification.request import Request
from idbench.experiments.identification.smooth_friction import places_of, sizes_of
from idbench.identify import ESTIMATORS, MODELS, ExcitationError, IdentificationError, MotionLog, Problem, attempt_each
from idbench.identify.arrays import TINY
from idbench.identify.data.motion_log import never_logged
from idbench.identify.judge.diagnosis import diagnosed, silent_joint, still_joints, unlogged, unrelated_joint
from idbench.identify.judge.stretches import held_out_errors
from idbench.identify.judge.suspect import Suspect
from idbench.identify.judge.used_rows import suited_reach
from idbench.identify.parameters.prior import evident_sizes

SPOILT = 0.5
"""Share of the error of the other joints that is left without the zeros of one, if its torque was not logged. Of a joint that
nobody drives zeros are right: without them others are not predicted better."""


MISSED = 0.3
"""Share of a torque like noise that the others say it should have at least, if it was not logged: a joint so light that noise
drowns its torque has less."""

BESIDE = "standard+load"  # Laws beside the smooth functions

FINE = 0.1
"""Velocity below which functions are fine, over the joint's rms speed: published Stribeck velocities, 0.02 to 0.5 rad/s, are
some tenths of the speeds of brisk motions (Armstrong-Helouvry et al., Automatica 30 (1994) 1083-1138)."""


def fit(request: Request, logs: Logs) -> Fit:
    """Return logs, identified: laws of friction chosen where that is asked for, what the logs do not show left out.

    Raises
    ------
    IdentificationError
        If no model has an estimate.
    """
    choice = None
    if request.robot_model.laws.auto:
        request, logs, choice = chosen_in_turns(request, logs)
    if request.robot_model.laws.smooth:
        request = _smoothed(request, logs.fitted)
    if request.robot_model.share_sought:
        request = replace(request, share=chosen_share(request, logs.fitted))
    problem = request.problem(logs.fitted)
    masked = list[str]()
    if reach := suited_reach(problem):
        request, before = replace(request, mask_reach=reach), problem
        problem = request.problem(logs.fitted)
        if masked := list(hidden_laws(before, problem)):
            request = replace(request, robot_model=request.robot_model.without(masked))
            problem = request.problem(logs.fitted)
    found, silent = _shown(request, logs, problem), list[Suspect]()
    while found.estimates and (suspect := _silent(found)):
        logs = found.logs.without_torque(suspect.joint or 0)
        quiet = _shown(request, logs, request.problem(logs.fitted))
        silent.append(replace(suspect, held_out=_errors(found, quiet)))
        found = quiet
    leading = next(iter(found.outcomes.values()))
    if not found.estimates and isinstance(leading, IdentificationError):
        raise _with_its_cause(found, leading)
    return replace(found, choice=choice, hidden=(*masked, *found.hidden), silent=tuple(silent))


def _shown(request: Request, logs: Logs, problem: Problem) -> Fit:
    """Return the fit of the parameters that the logs show: those that the leading model finds hidden are left out."""
    models = {name: MODELS.create(name) for name in request.models}
    found = Fit(request, logs, problem, attempt_each(problem, models, request.method.estimator))
    leading = next(iter(found.outcomes.values()))
    if not isinstance(leading, ExcitationError) or not 0 < len(leading.hidden) < len(found.basis.names):
        return found
    request = replace(request, robot_model=found.robot_model.without(leading.hidden))
    fewer = _shown(request, logs, request.problem(logs.fitted))
    return replace(fewer, hidden=(*leading.hidden, *fewer.hidden))


def _silent(found: Fit) -> Suspect | None:
    """Return a joint whose torque was not logged, if the rows allow the test, and others have one.

    Its own rows show it, or those of others, which its zeros spoil: without them, these are predicted better.
    """
    missing = len(never_logged(found.logs.fitted))
    if found.problem.long or found.problem.basis.n == 1 + missing:
        return None
    problem, X = found.problem.explicit, found.estimates[found.leading].X
    if (suspect := silent_joint(problem, X)) is not None:
        return suspect
    noise = unrelated_joint(problem)
    for j in (*(() if noise is None else (noise,)), *still_joints(problem)):
        logs = found.logs.without_torque(j)
        quiet = _shown(found.request, logs, found.request.problem(logs.fitted))
        before, after = _errors(found, quiet) if quiet.estimates else (0.0, 0.0)
        if after < SPOILT * before or (j == noise and quiet.estimates and _expected(quiet, problem, j) > MISSED):
            return unlogged(j)
    return None


def _expected(quiet: Fit, problem: Problem, j: int) -> float:
    """Torque of a joint that the rows of the others predict, over what was logged, rms."""
    known = dict(zip(quiet.basis.names, quiet.estimates[quiet.leading].X.tolist(), strict=True))
    own = problem.rows.group == j
    predicted = problem.rows.W[own] @ np.array([known.get(name, 0.0) for name in problem.names])
    return float(np.linalg.norm(predicted) / max(float(np.linalg.norm(problem.rows.Y[own])), TINY))


def _errors(before: Fit, after: Fit) -> tuple[float, float]:
    """Return the largest error of the other joints on stretches that were not fitted, with the rows of one and without [%]."""
    others = np.setdiff1d(np.arange(after.basis.n), never_logged(after.logs.fitted))
    each = (held_out_errors(one.problem)[others] for one in (before, after))
    return float(np.max(next(each))), float(np.max(next(each)))


def _with_its_cause(found: Fit, error: IdentificationError) -> IdentificationError:
    """The error, completed by its cause, with the residuals of least squares, if they depend on the motion."""
    if isinstance(error, ExcitationError) or found.request.method.estimator.filtered:
        return error
    try:
        suspects = diagnosed(found.problem, ESTIMATORS.create("GLS").fit(found.problem.explicit).X)
    except (IdentificationError, np.linalg.LinAlgError):
        return error
    causes = [cause.advice for cause in causes_of(suspects, found.robot_model, found.logs.fitted[0])]
    return IdentificationError(f"{error}; with GLS, {'; '.join(causes)}") if causes else error


def _smoothed(request: Request, logs: tuple[MotionLog, ...]) -> Request:
    """Return a request with smooth functions of each joint's velocity, of the sizes that make the logs most likely.

    tau_j = W_j x + Z_j u_j + e_j,   u_j ~ N(0, s_j^2 I),   s_j by `evident_sizes`
    """
    robot_model = request.robot_model
    plain = replace(request, robot_model=robot_model.plain).problem(logs)
    speed = np.sqrt(np.mean([np.mean(part.state.qd**2, axis=-1) for part in plain.signals], axis=0))
    joints = robot_model.robot.joints
    words = tuple(f"{said(j, joints)}={BESIDE}+smooth:{max(FINE * v, 1e-3):.4g}" for j, v in enumerate(speed))
    made = replace(request, robot_model=replace(robot_model, asked=replace(robot_model.asked, friction=words)))
    begin = sizes_of(logs)
    problem = replace(made, smooth=begin).problem(logs)
    places, of = (np.array(each) for each in places_of(problem.basis))
    groups = [places[of == j] for j in range(problem.basis.n)]
    return replace(made, smooth=tuple(evident_sizes(problem.factors.fit(2).factor.R, groups, np.array(begin)).tolist()))
