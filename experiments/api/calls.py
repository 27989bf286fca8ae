"""Robots, logs, fits and simulations: each function makes a request of its arguments, and does what its command does."""

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from idbench.experiments.api.keywords import with_keys
from idbench.experiments.api.logs import given_log
from idbench.experiments.api.results import Identification, SimulatedRun, path_of
from idbench.experiments.errors import ExperimentError
from idbench.experiments.identification.friction_laws import AUTO
from idbench.experiments.identification.job import chooses_band, fit_of, identified, request_of, robot_of, truth_of
from idbench.experiments.identification.load import judged_on, prepared, with_held_out
from idbench.experiments.identification.logs import delay_method
from idbench.experiments.identification.reading import ReadLog, file_of, late, read
from idbench.experiments.identification.robot_model import SCARA, RobotModel, absolute
from idbench.experiments.requests import jobs
from idbench.experiments.requests.shared import ColumnOptions, LogRequest, MountingOptions, Parameters
from idbench.experiments.requests.table import request_from
from idbench.experiments.requests.words import request_keys
from idbench.experiments.results.page import stages_of, watched
from idbench.identify import BLOCKS, CHAINS, ESTIMATORS, MODELS, MotionLog
from idbench.identify.plugins import Table, did_you_mean
from idbench.sim.engine.simulation import simulate as simulated
from idbench.sim.scenario.scenario import Scenario
from idbench.sim.scenario.scenario_file import load as load_scenario

AnyLog = MotionLog | str | Path
Logs = AnyLog | Sequence[AnyLog]

PARTS: Mapping[str, Table[Any]] = {"model": MODELS, "chain": CHAINS, "estimator": ESTIMATORS, "friction": BLOCKS, "add": BLOCKS}
"""Keys whose values may be objects, or classes, in the place of names."""


def _others(groups: Sequence[type], *, but: bool = False) -> set[str]:
    """Return the keys of requests of logs that are not those of some groups; `but`: those that are."""
    own = {key for group in groups for key in request_keys(group)}
    return own if but else request_keys(LogRequest).keys() - own


OF_ROBOT, OF_RUN = _others((Parameters, MountingOptions)), _others((Parameters,))
NOT_READ = _others((Parameters, MountingOptions), but=True) | {"robot", "mask_speed", "cutoff", "estimator"}
"""Keys of `LogRequest` that are none of loading a robot, of a run, of reading a log."""


@with_keys(LogRequest, OF_ROBOT)
def load_robot(robot: str | Path, **keys: Any) -> RobotModel:
    """Return a robot: its joints, and the parameters that can be identified.

    Parameters
    ----------
    robot : str or Path
        Name of a shipped robot, or its file: MJCF, URDF, or a table of Denavit-Hartenberg parameters (.toml).
    **keys
        Options of `idbench robot`: armature, friction, add, without, balancer; joints, lock, coupling, gravity.

    Raises
    ------
    ExperimentError, BenchError, IdentificationError
        If there is no such robot, or an option is unknown or wrong.

    Examples
    --------
    >>> import idbench
    >>> idbench.load_robot("scara", add="offset").basis.names[-2:]
    ('off1', 'off2')
    """
    asked = request_from(LogRequest, named(keys), "load_robot", taken=OF_ROBOT)
    made = RobotModel(absolute(str(path_of(robot, "load_robot"))), asked.parameters, asked.mounting.mounting)
    made.check()
    return made


@with_keys(LogRequest, NOT_READ)
def read_log(
    path: str | Path, torque: str | None = None, robot: RobotModel | str | Path | None = None, **keys: Any
) -> MotionLog:
    """Return the log of a file, or of the folder of a run.

    Parameters
    ----------
    path : str or Path
        CSV and other text, Parquet, NumPy, Matlab, a ROS bag.
    torque : {"held", "instantaneous", "averaged"}, optional
        What a torque sample means; needed unless the file states it.
    robot : RobotModel, str or Path, optional
        Whose joints give the order of the columns; by default the order of the file, with the names that it has.
    **keys
        Options of `idbench identify` for reading: torque_delay, unwrap, resample, columns, units, rows, gain, layout.

    Raises
    ------
    ExperimentError, LogError
        If the file cannot be read, or makes no log.
    """
    robot = robot if robot is None or isinstance(robot, RobotModel) else load_robot(robot)
    table = keys if torque is None else {**keys, "torque": torque}
    asked = request_from(LogRequest, table, "read_log", taken=NOT_READ)
    if sought := delay_method(asked.torque_delay):
        raise ExperimentError(f"torque_delay: the robot is needed for it: idbench.fit(..., torque_delay={sought!r})")
    file = file_of(path_of(path, "read_log"))
    found = read(file, asked, robot)
    if len(found.logs) > 1:
        raise ExperimentError(f"{file} has {len(found.logs)} pieces with gaps between them: give the file itself to the fit")
    return replace(found.logs[0], joints=found.columns.joints if robot is None else robot.robot.joints)


@with_keys(jobs.IdentifyRequest, {"label"})
def fit(
    log: Logs,
    robot: RobotModel | str | Path | None = None,
    *,
    validate: Logs = (),
    truth: Mapping[str, float] | None = None,
    **keys: Any,
) -> Identification:
    """Return the fit of a log, or of several together, as `idbench identify` makes it.

    Parameters
    ----------
    log : MotionLog, str, Path, or a sequence of them
        The logs, or their files.
    robot : RobotModel, str or Path, optional
        The robot, its name or its file; by default the SCARA, or the robot of the run.
    validate : MotionLog, str, Path, or a sequence of them
        Held-out logs on which the fit is judged; by default the last quarter of the longest, predicted by a fit of the rest.
    truth : mapping of str to float, optional
        True parameters, where they are known.
    **keys
        Options of `idbench identify`: model, chain, estimator, friction, armature, torque, torque_delay, cutoff, consistent,
        and so on. Models, chains, estimators and laws of friction may be names, objects or classes.

    Raises
    ------
    ExperimentError, IdentificationError, BenchError
        If an option is unknown or wrong, or nothing can be identified.

    Examples
    --------
    >>> import idbench
    >>> run = idbench.simulate("ideal")
    >>> found = idbench.fit(run.log, run.robot, model="explicit", estimator="OLS")
    >>> found.parameters["Fs1"].unit, round(found.parameters["Fs1"].value, 4)
    ('N m', 0.5)
    """
    logs, held_out = several(log), several(validate)
    model = robot if isinstance(robot, RobotModel) else None
    _require_logs(logs, held_out, keys)
    table = named(keys) | ({} if robot is None or model else {"robot": robot})
    paths = {name: tuple(map(Path, given)) for name, given in (("log", logs), ("validate", held_out)) if _files(given)}
    asked = request_from(jobs.IdentifyRequest, table | paths, "fit", taken={"label"})
    sought = delay_method(asked.torque_delay)
    if model is None and _files(logs) and _files(held_out) and truth is None:
        with watched(lambda: stages_of("identifying")):
            return Identification(identified(asked), sought is None)
    if model is not None:
        model = _with_keys(model, asked, table)
    else:
        name = robot_of(asked).name if asked.log else absolute(asked.robot or SCARA)
        model = RobotModel(name, asked.parameters, asked.mounting.mounting)
    request = request_of(asked, model)
    truth = _whole(truth, model)
    loaded = prepared(_read(logs, asked, model), request, sought=sought, band=chooses_band(asked))
    known = truth if truth is not None or not _files(logs) else truth_of(asked, request)
    if held_out and _files(held_out):
        found = with_held_out(loaded, asked, known)
    else:
        others = _read(held_out, asked, model)
        others = [late(each, loaded.read[0].channel) for each in others] if sought else others
        found = judged_on(loaded, {f"{k + 1}": each for k, each in enumerate(others)}, known, sought)
    with watched(lambda: stages_of("identifying")):
        return Identification(fit_of(loaded.request, found), sought is None)


@with_keys(LogRequest, OF_RUN)
def simulate(scenario: str | Path | Scenario, seed: int | None = None, **keys: Any) -> SimulatedRun:
    """Return a scenario, simulated: its log, its robot, and the true parameters.

    Parameters
    ----------
    scenario : str, Path or Scenario
        Name of a shipped scenario (`idbench scenario` lists them), its file (TOML), or the scenario itself.
    seed : int, optional
        Seed of all that is random; by default that of the scenario. The same seed gives the same bits.
    **keys
        Which parameters the robot is to have: armature, friction, add, without, balancer.

    Raises
    ------
    ExperimentError, BenchError
        If there is no such scenario, or it cannot be simulated.
    """
    made = scenario if isinstance(scenario, Scenario) else load_scenario(str(path_of(scenario, "simulate")))
    made = made if seed is None else replace(made, seed=seed)
    asked = request_from(LogRequest, named(keys), "simulate", taken=OF_RUN)
    return SimulatedRun(simulated(made), RobotModel(made.robot, asked.parameters))


def named(keys: Mapping[str, Any]) -> dict[str, Any]:
    """Return keys with names in the place of objects and classes, which the tables have from now on."""
    return {key: _names(key, value) if key in PARTS else value for key, value in keys.items()}


def _names(key: str, value: Any) -> Any:
    names = tuple(map(PARTS[key].name_of, several(value)))
    for name, each in zip(names, several(value), strict=True):
        for word in re.split(r"[\s=+]", name) if name == each else ():
            PARTS[key].require_one(word)
    if key == "friction" and len(names) > 1 and not any("=" in name or name == AUTO for name in names):
        return ("+".join(names),)  # laws of all joints, one beside the other
    return names if isinstance(value, list | tuple) or len(names) != 1 else names[0]


def several(given: Any) -> tuple[Any, ...]:
    """Return one thing, or several, as a tuple."""
    one = isinstance(given, str | Path | MotionLog) or not isinstance(given, Iterable)
    return (given,) if one else tuple(given)


def _files(logs: Sequence[Any]) -> bool:
    """True if logs are files; raise ExperimentError if some are and others are not."""
    files = [isinstance(log, str | Path) for log in logs]
    if any(files) and not all(files):
        raise ExperimentError("give logs as files, or as MotionLog: not some of each")
    return all(files)


def _require_logs(logs: Sequence[Any], held_out: Sequence[Any], keys: Mapping[str, Any]) -> None:
    """Raise ExperimentError if something is no log, or keys say how logs are read that were read already."""
    if not logs:
        raise ExperimentError("fit: name a log, or several of one fit")
    if wrong := [each for each in (*logs, *held_out) if not isinstance(each, AnyLog)]:
        raise ExperimentError(f"fit: {wrong[0]!r:.60} is no log: give a MotionLog, as read_log returns it, or a file")
    reading = {*request_keys(ColumnOptions), "torque", "unwrap"}
    if not delay_method(keys.get("torque_delay")):
        reading.add("torque_delay")
    if not _files(logs) and (given := [key for key in keys if key in reading]):
        raise ExperimentError(f"fit: {', '.join(given)} is how a log is read, and this one is: give it to read_log")


def _whole(truth: Mapping[str, float] | None, model: RobotModel) -> Mapping[str, float] | None:
    """Return true parameters, 0 for those of added laws; raise ExperimentError if one is unknown, or another is missing."""
    if truth is None:
        return None
    if not isinstance(truth, Mapping):
        raise ExperimentError(f"truth = {truth!r:.60}: give a mapping of names to values, such as {{'Fs1': 0.5}}")
    names = model.basis.names
    if name := next((name for name in truth if name not in names), None):
        hint = did_you_mean(name, names)
        raise ExperimentError(f"truth: there is no parameter {name}{hint}; there are {', '.join(names)}")
    plain = replace(model, asked=Parameters()).basis.names
    if missing := [name for name in names if name not in truth and name in plain]:
        raise ExperimentError(f"truth: {', '.join(missing)} is missing: give 0 for what the robot does not have")
    return {name: truth.get(name, 0.0) for name in names}


def _with_keys(model: RobotModel, asked: jobs.IdentifyRequest, table: Mapping[str, Any]) -> RobotModel:
    """Return a robot with the parameters that keywords ask for beside its own."""
    if mounting := [key for key in request_keys(MountingOptions) if key in table]:
        raise ExperimentError(f"fit: {', '.join(mounting)} is what the robot is loaded with: give it to load_robot")
    given = {key: getattr(asked.parameters, key) for key in request_keys(Parameters) if key in table}
    if "add" in given:  # beside its own
        given["add"] = (*model.asked.add, *given["add"])
    return replace(model, asked=replace(model.asked, **given)) if given else model


def _read(logs: Sequence[AnyLog], asked: jobs.IdentifyRequest, model: RobotModel) -> list[ReadLog]:
    """Return logs, those of Python as if they had been read."""
    return [
        given_log(f"log {k + 1}", log, model) if isinstance(log, MotionLog) else read(file_of(Path(log)), asked, model)
        for k, log in enumerate(logs)
    ]
