"""The job `identify`: a request becomes logs, a fit, and a judgement."""

import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from idbench.experiments.errors import ExperimentError
from idbench.experiments.identification.chain_settings import chain_of
from idbench.experiments.identification.fit import Fit
from idbench.experiments.identification.fitting import fit
from idbench.experiments.identification.friction_choice import summary, words
from idbench.experiments.identification.iterations import iterations
from idbench.experiments.identification.load import in_band, load, with_held_out
from idbench.experiments.identification.log_warnings import unchanging, warnings_of_log
from idbench.experiments.identification.logs import Logs
from idbench.experiments.identification.method import Method
from idbench.experiments.identification.rates import CONTROLLER
from idbench.experiments.identification.reading import file_of, stated_by
from idbench.experiments.identification.request import Request
from idbench.experiments.identification.robot_model import ASSUMED, SCARA, RobotModel, absolute
from idbench.experiments.requests.jobs import IdentifyRequest
from idbench.experiments.requests.shared import CHAIN
from idbench.identify import MODELS, IdentificationError
from idbench.identify.models import THREE
from idbench.identify.signals.masks import NoMask
from idbench.sim.scenario.scenario_file import load as load_scenario


def identified(asked: IdentifyRequest) -> Fit:
    """Return the fit of the logs of a request; `judge` says how good it is on logs that it was not fitted to.

    Raises
    ------
    ExperimentError, IdentificationError, BenchError
        If something is wrong with the request, its files, or the logs.
    """
    return fit_of(*loaded_logs(asked, request_of(asked)))


def request_of(asked: IdentifyRequest, robot_model: RobotModel | None = None) -> Request:
    """The checked request, before any log is read; the robot by default that of the run's folder."""
    if not asked.log and robot_model is None:
        raise ExperimentError("name a log, or several of one fit")
    for path in (*asked.log, *asked.validate):
        file_of(path)
    _require_label(asked.label)
    own = [path / "scenario.toml" for path in asked.log]
    loops = asked.loop or ([str(own[0])] if len(own) == 1 and own[0].is_file() else [])
    request = Request(
        robot_model or robot_of(asked),
        THREE if asked.model is None else tuple(MODELS) if asked.model == "all" else (asked.model,),
        Method.named(asked.chain, asked.estimator),
        name=asked.label,
        loops=tuple(map(load_scenario, loops)),
        start=asked.start,
        mask_speed=asked.mask_speed,
        wdyn=_wdyn(asked.wdyn, own),
    )
    if asked.loop and "loop" not in request.method.estimator.needs:
        raise ExperimentError(
            f"--loop: {asked.estimator} simulates no loop; leave it out, or use --estimator IV, DIDIM, CLIE or CLOE"
        )
    return _with_chain(asked, request)


def _wdyn(stated: float | None, scenarios: Sequence[Path]) -> tuple[float, str] | None:
    """Return the bandwidth of the position loop that is stated, or that of the controller of a run, with its source."""
    if stated is not None:
        return stated, "as stated"
    found = next((load_scenario(str(path)).wdyn for path in scenarios if path.is_file()), None)
    return None if found is None else (found, CONTROLLER)


def robot_of(asked: IdentifyRequest) -> RobotModel:
    """Return the robot that is named, or that of the run; the shipped SCARA where neither says it."""
    known = stated_by(asked.log[0]).get("robot") if asked.robot is None else absolute(asked.robot)
    return RobotModel(str(known or SCARA), asked.parameters, asked.mounting.mounting, assumed=known is None)


def loaded_logs(asked: IdentifyRequest, request: Request) -> tuple[Request, Logs]:
    """Return the request with the band that suits the logs, and the logs, those that are held out among them."""
    loaded = load(asked.log, asked, request, band=chooses_band(asked))
    return loaded.request, with_held_out(loaded, asked, truth_of(asked, request))


def fit_of(request: Request, logs: Logs) -> Fit:
    """Return the fit of logs; what goes wrong says what is suspicious about them, too."""
    try:
        return fit(request, logs)
    except IdentificationError as error:
        tree = request.robot_model.tree
        doubts = dict.fromkeys(x for log in logs.fitted for x in (*warnings_of_log(log, tree), *unchanging(log, tree)))
        why = f"; what is suspicious: {'; '.join(doubts)}" if doubts else ""
        raise ExperimentError(f"{error}{why}") from error


def summary_of(made: Fit) -> dict[str, Any]:
    """Summary of a fit."""
    chosen = {} if made.choice is None else {"friction": summary(made.choice)}
    return {**chosen, **made.summary(), "iterations": iterations(made), "notes": list(notes_of(made))}


def notes_of(made: Fit) -> tuple[str, ...]:
    """Notes on reading and assumptions, and the chosen laws of friction."""
    robot_model, choice = made.robot_model, made.choice
    laws = () if choice is None else words(choice, robot_model.laws.names, robot_model.robot.joints)
    assumed = (ASSUMED,) if robot_model.assumed else ()
    return (*made.logs.notes, *(f"the robot's file has {note}" for note in robot_model.robot.notes), *laws, *assumed)


def truth_of(asked: IdentifyRequest, request: Request) -> dict[str, float] | None:
    """Return the truth that the folder of a run states, if it is of the same parameters."""
    stated = stated_by(asked.log[0])
    truth: dict[str, float] = stated.get("truth") or {}
    further = stated.get("further_truth", {})
    own = tuple(name for name in request.robot_model.basis.names if name in truth or name not in further)
    return truth | further if truth and tuple(truth) == own else None


def chooses_band(asked: IdentifyRequest) -> bool:
    """True if the band is to suit the logs: nothing states it."""
    return asked.cutoff is None and asked.chain_file is None and asked.chain == CHAIN


def _with_chain(asked: IdentifyRequest, request: Request) -> Request:
    """Return a request with the chain that options and files state."""
    if asked.chain_file is not None and asked.cutoff is not None:
        raise ExperimentError("--cutoff and --chain-file both say the band: give one")
    if asked.chain_file is not None:
        name, chain = chain_of(asked.chain_file)
        return request.with_chain(chain, name)
    if request.robot_model.asked.armature == "none" and asked.chain == CHAIN and not asked.mask_speed:
        # Behind the gears next to no friction is left that turns with the velocity: nothing to mask.
        request = request.with_chain(replace(request.method.chain, mask=NoMask()))
    return request if asked.cutoff is None else in_band(request, asked.cutoff)


def _require_label(label: str) -> None:
    if label and (not re.fullmatch(r"[A-Za-z0-9][\w.-]*", label) or label == "inner"):
        raise ExperimentError(f"--label {label!r} must be of letters, digits, dots, hyphens and underscores, and not 'inner'")
