"""What is most likely to mend an identification that is not good, tried out: the likely cause first."""

import time
from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np

from idbench.experiments.errors import ExperimentError
from idbench.experiments.identification.fit import Fit
from idbench.experiments.identification.friction_choice import chosen_friction
from idbench.experiments.identification.log_warnings import jumps_of, unchanging, warnings_of_log
from idbench.experiments.identification.logs import with_delay
from idbench.experiments.identification.prior_share import chosen_share
from idbench.experiments.identification.request import Request
from idbench.experiments.identification.robot_model import RobotModel
from idbench.experiments.judgement.held_out import HeldOut
from idbench.experiments.judgement.judgement import Judgement
from idbench.experiments.judgement.warnings import (
    DELAY,
    FILE,
    LOG,
    MODEL,
    MOTION,
    hidden_notes,
    undescribed,
    warnings_of_result,
    wrong_sign,
)
from idbench.experiments.note import Note, noted
from idbench.experiments.text import error_percentage
from idbench.identify import IdentificationError, RangeError, WeightedLeastSquares, estimate, validate
from idbench.identify.judge.delay import estimate_delay, nearby_delay
from idbench.identify.judge.small_mistakes import WORTH as WORTH_A_WORD
from idbench.identify.judge.stretches import held_out_errors
from idbench.identify.telling import stage
from idbench.sim.errors import BenchError

NEGLIGIBLE = 2e-3
"""Share of a sampling period by which a delay may be off without a word: a hundredth of the SCARA's Fv1 at 100 Hz."""

SURE = 4.0  # A delay that differs from the stated one by more than so many sigma is reported

WORTH, TOLERABLE = 0.7, 20.0
"""Options are recommended if they bring the error below this share of what it was, and below so many per cent."""

MOST_TIME, AUTO_FITS = 60.0, 100
"""Time [s] that trials may take; fits whose time a choice of friction laws takes, about: 60 s where a fit takes 0.6 s."""

AUTO = "--friction auto"

DRASTIC = 1 / 3  # Below this share of what it was they are recommended whatever is left


def delay_advice(result: Fit) -> Iterator[str]:
    """Yield the torque delay that the log itself shows, where it differs from the assumed one."""
    logs = result.logs.fitted
    assumed = logs[0].torque.delay
    # Where a log needs a prior, its delay is not known without.
    if wrong_sign(result) or logs[0].poses or result.robot_model.asked.prior:
        return
    try:
        near = nearby_delay(result.problem)
        if SURE * near.doubt < 1 / logs[0].fs and abs(near.delay - assumed) <= SURE * near.doubt:
            return  # a search would end here
        measured = estimate_delay(list(logs), result.basis, result.processing)
    except RangeError as error:
        yield f"the delay of the torque is far from the assumed one, or unrelated to this motion: {error}"
        return
    except (IdentificationError, np.linalg.LinAlgError):
        return
    if abs(measured.delay - assumed) <= max(SURE * measured.doubt, NEGLIGIBLE / logs[0].fs):
        return
    # Inertia behind much friction looks like a delay: held-out stretches distinguish them, or nothing does.
    delayed = result.problem.explicit.with_logs([with_delay(log, measured) for log in logs])
    before, after = (np.log(held_out_errors(problem)) for problem in (result.problem.explicit, delayed))
    if np.nansum(after) < np.nansum(before) and np.exp(np.nanmin(after - before)) < WORTH_A_WORD:
        yield Note(
            f"the log shows a torque delay of {1e3 * measured.delay:.3g} ms (sigma {1e3 * measured.doubt:.1g}), where "
            f"{1e3 * assumed:.3g} ms is assumed: --torque-delay estimate",
            option="--torque-delay estimate",
        )


def remedies(held_out: HeldOut) -> Iterator[str]:
    """Yield options with which the error of a fit on a held-out log falls, and how far."""
    request = held_out.fit.request
    before = least = _worst(held_out, request)
    begin, tried = time.perf_counter(), 0
    for option, make in _others(held_out).items():
        spent = time.perf_counter() - begin
        # What is well enough is not worth the time.
        if spent > MOST_TIME or (option == AUTO and (spent * AUTO_FITS > MOST_TIME * max(tried, 1) or least < TOLERABLE)):
            continue
        tried += 1
        try:
            with stage(f"trying {option}"):
                after = _worst(held_out, replace(request, robot_model=make()))
        except (IdentificationError, ExperimentError, BenchError):
            continue
        if option == AUTO and after > WORTH * least:  # it finds what the others say, too
            continue
        least = min(least, after)
        if after < min(WORTH * before, TOLERABLE) or after < DRASTIC * before:
            fall = f"from {error_percentage(before)} to {error_percentage(after)}"
            yield Note(f"with {option} the worst joint's error falls {fall}", option=option)


def _others(held_out: HeldOut) -> dict[str, Callable[[], RobotModel]]:
    """Return the options, and what makes the robot that each describes."""
    request, found = held_out.fit.request, dict[str, Callable[[], RobotModel]]()
    robot_model, asked, joints = request.robot_model, request.robot_model.asked, request.robot_model.robot.joints
    known = asked.prior or "links=file" in asked.hold
    if not known and request.method.estimator.takes_prior and not robot_model.basis.is_nonlinear:  # which takes minutes
        found["--prior file"] = lambda: replace(robot_model, asked=replace(asked, prior=("file",)))
    if not all(joint.armature for joint in robot_model.tree.joints):
        found["--armature all"] = lambda: replace(robot_model, asked=replace(asked, armature="all"))
    if "offset" not in asked.add:
        found["--add offset"] = lambda: replace(robot_model, asked=replace(asked, add=(*asked.add, "offset")))
    if len(joints) > 1 and not robot_model.tree.couplings:
        drive = f"motor{len(joints)}", ((joints[-2], 1.0), (joints[-1], 1.0))
        option = f"--coupling {drive[0]}={joints[-2]}+{joints[-1]}"
        found[option] = lambda: replace(robot_model, mounting=replace(robot_model.mounting, couplings=(drive,)))
    if robot_model.laws.standard and asked.friction == ("standard",):
        found[AUTO] = lambda: chosen_friction(request, held_out.fit.logs.fitted, most=1)[0].robot_model
    return found


def _worst(held_out: HeldOut, request: Request) -> float:
    """Return the largest error [%] of the explicit model on the held-out log."""
    if request.robot_model.share_sought:
        request = replace(request, share=chosen_share(request, held_out.fit.logs.fitted))
    problem = request.problem(held_out.fit.logs.fitted)
    simulates = {"loop", "plant"} & request.method.estimator.needs  # which takes far too long to try with
    X = estimate(problem, WeightedLeastSquares() if simulates else request.method.estimator).X
    unseen = replace(held_out, fit=replace(held_out.fit, request=request, problem=problem)).problem
    return float(np.nanmax(validate(unseen, X).percent))


def checks(judgement: Judgement, *, delay: bool, trials: bool = True) -> dict[str, list[str]]:
    """Return warnings by what they are about.

    Parameters
    ----------
    judgement : Judgement
        The judged fit.
    delay : bool
        Whether the delay of the torques was given, so that it is compared with that which the log shows.
    trials : bool
        Whether other options are tried on the held-out data where no model is good.
    """
    result = judgement.fit
    found = {LOG: warnings_of_logs(judgement), DELAY: [], FILE: undescribed(result.robot_model.robot), MOTION: [], MODEL: []}
    if any(map(jumps_of, result.logs.fitted)):  # all else may be their doing: no advice can be drawn from it
        return found
    found[MOTION] += hidden_notes(result)
    for about, warnings in warnings_of_result(result).items():
        found[about] += warnings
    hardest = judgement.hardest
    if hardest is not None and not result.logs.long:
        # Friction absorbs a wrong delay, and the verdict may be good: the log itself is asked.
        found[DELAY] += delay_advice(result) if delay else ()
        found[MODEL] += remedies(hardest) if trials and not judgement.good else ()
    late = [("delay", "torque", None)] if any(noted(advice).option for advice in found[DELAY]) else []
    of_model = (c for c in result.diagnosis or () if (c.suspect.cause, c.suspect.of, c.suspect.joint) not in late)
    found[MODEL] += [cause.advice for cause in of_model]
    return found


def warnings_of_logs(judgement: Judgement) -> list[str]:
    """Doubts about the logs, fitted and held out."""
    logs, tree = judgement.fit.logs, judgement.fit.robot_model.tree
    every = [(f"{logs.name(k)}: " if len(logs.fitted) > 1 else "", log) for k, log in enumerate(logs.fitted)]
    every += [(f"{name}: ", log) for name, log in (logs.held_out or {}).items()]
    untested = judgement.fit.diagnosis is None
    return [
        Note(before + warning, option=noted(warning).option, about=noted(warning).about)
        for before, log in every
        for warning in (*warnings_of_log(log, tree), *(unchanging(log, tree) if untested else ()))
    ]
