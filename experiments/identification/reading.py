"""Logs, read as options say."""

import json
import shlex
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

import idbench.experiments.recording.log_table  # noqa: F401  # which adds a format
from idbench.experiments.errors import ExperimentError
from idbench.experiments.identification.logs import DELAYS, with_delay
from idbench.experiments.identification.poses import are_poses, poses_of
from idbench.experiments.identification.request import Request
from idbench.experiments.identification.robot_model import RobotModel
from idbench.experiments.note import Note
from idbench.experiments.program import program
from idbench.experiments.requests.shared import ColumnOptions, LogRequest
from idbench.experiments.requests.words import Meaning
from idbench.identify import Array, AsLogged, LogError, MotionLog, RangeError, SettingError, TimeError, TorqueChannel
from idbench.identify.data.log_columns import LogColumns
from idbench.identify.data.resample import Repaired
from idbench.identify.files.formats import read_table
from idbench.identify.files.guess_units import FARTHEST, SAY_UNIT
from idbench.identify.files.layout import Asked, LogLayout
from idbench.identify.files.reading import LAYOUT_FILE, read_columns
from idbench.identify.judge.delay import DelayEstimate

DELAY_FOUND = "delay"  # Mark of the note on a delay, which those leave out who print it beside the torque

LATEST = 1.0  # Delay [s] that no torque of a log has
TURN = 2 * np.pi  # [rad]
NEARLY = 0.2  # Share of a turn by which a jump may differ from one: the joint moves on between two samples


def file_of(log: Path) -> Path:
    """Return the log of a results folder, or the log itself."""
    if not log.is_dir() or (log / "metadata.yaml").is_file():  # of a ROS bag
        return log
    if not (log / "log.parquet").is_file():
        raise ExperimentError(f"there is no log.parquet in {log}: name a log, or the folder of a run")
    return log / "log.parquet"


def stated_by(log: Path) -> dict[str, Any]:
    """Statements of a results folder's summary about its run: robot, parameters, truth; nothing of a file."""
    path = log / "summary.json"
    if not path.is_file():
        return {}
    try:
        stated = json.loads(path.read_text())
        names, values = stated["parameters"], stated["truth"]
        known = None if values is None else dict(zip(names, map(float, values), strict=True))
        others = {str(name): float(x) for name, x in stated.get("further_truth", {}).items()}
        robot = str(stated.get("robot") or stated["scenario"]["robot"])
        return {"robot": robot, "truth": known, "further_truth": others}
    except (ValueError, KeyError, TypeError, AttributeError, OSError, RecursionError) as error:
        raise ExperimentError(f"{path} is no summary of a run ({error}): name the log itself, {log / 'log.parquet'}") from error


@dataclass(frozen=True, eq=False)
class ReadLog:
    """A log as it was read."""

    path: Path
    """Its file."""
    logs: tuple[MotionLog, ...]
    """The log; its pieces, if it has gaps."""
    columns: LogColumns
    """What the file holds."""
    channel: TorqueChannel
    """What its torque means, as it was logged."""
    notes: tuple[str, ...] = ()
    """What was done or assumed."""
    simulated: bool = False
    """Whether it is stated to be of MuJoCo's simulation of the robot's file."""

    @property
    def longest(self) -> MotionLog:
        """The log, or the longest of its pieces."""
        return max(self.logs, key=lambda log: log.samples)


def read(path: Path, options: LogRequest, robot_model: RobotModel | None, fallback: TorqueChannel | None = None) -> ReadLog:
    """Return the log, its torque read as the options say; its delay is that which is stated.

    Joints are in the order of the robot; without one in that of the file. `fallback` is what its torque means where neither
    the file nor options say it.
    """
    columns, before = _ordered(path, read_columns(path, asked_of(options.reading)), robot_model)
    names = columns.names if robot_model is None else robot_model.robot.joints
    hinges = [True] * columns.n if robot_model is None else [joint.kind == "hinge" for joint in robot_model.tree.joints]
    stated = columns.torque or fallback
    channel = channel_of(stated, _meaning(path, options, stated), options.torque_delay)
    poses = columns.qdd is not None or are_poses(path, columns, stated=options.reading.poses)
    if not np.any(columns.tau) and np.ptp(columns.q, axis=0).any() and not (robot_model and robot_model.basis.held):
        raise ExperimentError(
            f"{path}: all torques are 0: there is nothing to identify; of joints that nobody drives friction can be, where the "
            "links are known: --hold links=file"
        )
    if not poses:
        columns = replace(columns, q=_turned(path, columns.q, names, hinges, options.unwrap))
    assumed = options.torque_delay is None and stated is None and not options.reading.simulated
    notes = [columns.said] if columns.said else []
    absent = ", ".join(names[j] for j in columns.missing)
    notes += [f"the log has no torque of {absent}: its rows are left out, and what only they would show"] if absent else []
    notes += ["no positions were logged: velocities are integrated, from 0"] if columns.integrated else []
    notes += [f"names of the log's joints have {before!r} before those of the robot's"] if before else []
    if poses:
        log, said = poses_of(columns, channel)
        return ReadLog(path, (log,), columns, channel, (*notes, said))
    notes += ["no --torque-delay was given, 0 is assumed: `estimate` finds it"] if assumed else []
    if options.reading.resample or columns.t_tau is not None:
        repaired = Repaired.of(columns, channel)
        words = (*repaired.words(names), *notes)
        return ReadLog(path, repaired.logs, columns, channel, words, options.reading.simulated)
    try:
        log = MotionLog.at_times(columns.t, columns.q, columns.tau, channel, columns.conditions, columns.missing)
    except TimeError as error:
        late = f" --torque-delay {channel.delay:g}" if channel.delay else ""
        raise ExperimentError(
            f"{path}: {error}: add --resample, or write it anew and look: {program()} resample {shlex.quote(str(path))} "
            f"--torque {channel.meaning}{late} --out uniform.parquet"
        ) from error
    return ReadLog(path, (log,), columns, channel, tuple(notes), options.reading.simulated)


def _ordered(path: Path, columns: LogColumns, robot_model: RobotModel | None) -> tuple[LogColumns, str]:
    """Return columns in the order of a robot's joints, and what their names have before those of the joints."""
    if robot_model is None:
        return columns, ""
    joints = robot_model.mounting.joints
    columns = columns if columns.joints or len(joints) != columns.n else replace(columns, joints=joints)
    try:
        return columns.ordered(robot_model.robot.joints), columns.prefixed(robot_model.robot.joints)
    except LogError as error:
        raise ExperimentError(
            f"{path}: {error}; name the robot of the log with --robot{_joints_of(columns, robot_model)}"
        ) from error


def _meaning(path: Path, options: LogRequest, stated: TorqueChannel | None) -> Meaning:
    """Meaning of a log's torque; raise ExperimentError if nobody states it."""
    if options.reading.simulated and options.torque not in (None, "instantaneous"):
        raise ExperimentError(
            f"--simulated --torque {options.torque}: torques of MuJoCo are instantaneous, beside the positions about which it "
            "steps: leave --torque out"
        )
    meaning = options.torque or (stated.meaning if stated else "instantaneous" if options.reading.simulated else None)
    if meaning is None:
        raise ExperimentError(
            f"{path} does not say what its torque means: add --torque held (a controller's command), instantaneous (a "
            "measurement) or averaged, and --torque-delay SECONDS or estimate; or --simulated, if it is of MuJoCo's simulation "
            "of the robot's file"
        )
    return meaning


def read_as(
    first: Path, path: Path, options: LogRequest, robot_model: RobotModel | None, fallback: TorqueChannel | None = None
) -> ReadLog:
    """Return a log, its columns as the file beside another log says where none is beside this one.

    Logs that idbench wrote say it themselves; so do those that do not have the columns of the other.
    """
    beside = LogLayout.beside(first)
    itself = path.suffix.lower() == LAYOUT_FILE or LogLayout.beside(path) is not None
    if (
        beside is None
        or beside[0].files
        or asked_of(options.reading) != Asked()
        or itself
        or read_table(path).torque is not None
    ):
        return read(path, options, robot_model, fallback)
    try:
        found = read(path, replace(options, reading=replace(options.reading, layout=beside[1])), robot_model, fallback)
    except (LogError, ExperimentError):
        return read(path, options, robot_model, fallback)
    return replace(found, notes=(f"columns are what {beside[1].name} beside {first.name} says", *found.notes))


def with_delays(every: Sequence[ReadLog], request: Request, sought: str) -> list[ReadLog]:
    """Return logs with the delay of their torques, `sought` of `DELAYS`, from all that have the same meaning together."""
    if isinstance(request.processing.alignment, AsLogged):
        raise ExperimentError(
            f"--torque-delay {sought}: --chain {request.method.chain_name} takes torques as they were logged and reads no "
            "delay: leave one of the two out"
        )
    found, unknown = dict[str, DelayEstimate](), dict[str, str]()
    for meaning in {log.logs[0].torque.meaning for log in every}:
        alike = [log for read in every for log in read.logs if log.torque.meaning == meaning]
        try:
            found[meaning] = DELAYS[sought](alike, request.robot_model.basis, request.processing)
        except RangeError as error:
            laws = " ".join(request.robot_model.asked.friction)
            without = "" if request.robot_model.laws.standard else f", with --friction {laws}: does that fit the robot?"
            unknown[meaning] = f"torque delay not found: {error}{without}"
    return [_delayed(log, found, unknown) for log in every]


def _delayed(read: ReadLog, every: Mapping[str, DelayEstimate], unknown: Mapping[str, str]) -> ReadLog:
    """Return a log with the delay of its meaning; where none was found, with the stated one, and a note."""
    meaning = read.logs[0].torque.meaning
    if meaning in unknown:
        return replace(read, notes=(*read.notes, f"{unknown[meaning]}; {read.channel.delay:g} s is assumed"))
    found = every[meaning]
    logs = tuple(with_delay(log, found) for log in read.logs)
    notes = (*read.notes, Note(f"torque delay estimated from the log: {found.words}", about=DELAY_FOUND))
    return replace(read, logs=logs, channel=found.of(read.channel), notes=notes)


def late(read: ReadLog, channel: TorqueChannel) -> ReadLog:
    """Return a log whose torques have the delay of a channel."""
    logs = (replace(log, torque=replace(log.torque, delay=channel.delay, lags=channel.lags)) for log in read.logs)
    return replace(read, logs=tuple(logs))


def asked_of(options: ColumnOptions) -> Asked:
    """What options say of a log's columns."""
    layout = LogLayout.read(options.layout) if options.layout else None
    said = said_of(options.columns, options.units, options.rows, ("t", "q", "qd", "qdd", "tau"))
    return replace(said, layout=layout, gain=options.gain, samples=options.samples)


def said_of(columns: Sequence[str], units: Sequence[str], rows: Sequence[str], known: Sequence[str]) -> Asked:
    """What texts NAME=VALUE say of the columns of `known` quantities, of their units and of rows."""
    found = list[dict[str, str]]()
    for option, texts in (("columns", columns), ("units", units)):
        if wrong := [text for text in texts if text.partition("=")[0] not in known or not text.partition("=")[2]]:
            some = ", ".join(f"{name}=..." for name in known)
            raise ExperimentError(f"--{option} {wrong[0]}: give {some}, such as q=position_*")
        found.append({name: value for name, _, value in (text.partition("=") for text in texts)})
    try:
        conditions = {name: float(value) for name, _, value in (text.partition("=") for text in rows)}
    except ValueError:
        raise ExperimentError(f"--rows {' '.join(rows)}: give columns and numbers, such as episode_index=3") from None
    try:
        return Asked(None, {name: tuple(value.split(",")) for name, value in found[0].items()}, found[1], conditions)
    except SettingError as error:
        raise ExperimentError(f"--units: {error}") from error


def _joints_of(columns: LogColumns, robot_model: RobotModel) -> str:
    """Hint how to state the joints of a log, where they are fewer than the robot's."""
    known = robot_model.robot.joints
    if columns.n >= len(known):
        return ""
    those = columns.joints if set(columns.joints) <= set(known) and columns.joints else known[: columns.n]
    return f", or the joints that it has: --joints {' '.join(those)} (the others are held at 0, or where --lock says)"


def _turned(path: Path, q: Array, names: Sequence[str], hinges: Sequence[bool], unwrap: bool) -> Array:
    """Return positions whose hinges do not jump by a turn, undone if that is wanted; raise ExperimentError if it is not."""
    q = q.copy()
    for j, hinge in enumerate(hinges):
        jumps = np.abs(np.abs(np.diff(q[:, j])) - TURN) < NEARLY * TURN
        if hinge and np.ptp(q[:, j]) > FARTHEST and np.nanmax(np.abs(np.diff(q[:, j])), initial=0.0) > TURN / 2:
            most = np.nanmax(np.abs(q[:, j]))
            raise ExperimentError(
                f"{path}: {names[j]} reaches {most:.5g} rad, and moves by more than half a turn from one sample to the next: "
                f"{SAY_UNIT}"
            )
        if not hinge or not jumps.any():
            continue
        if not unwrap:
            k = int(np.argmax(jumps))
            raise ExperimentError(
                f"{path}: {names[j]} jumps from {q[k, j]:.4g} to {q[k + 1, j]:.4g} rad at sample {k + 1}: an angle that "
                "starts anew at every turn? Add --unwrap to count the turns"
            )
        known = np.isfinite(q[:, j])
        q[known, j] = np.unwrap(q[known, j])
    return q


def channel_of(stated: TorqueChannel | None, meaning: Meaning, delay: str | None) -> TorqueChannel:
    """Return the channel that a file and the options state together: another meaning voids the delay that the file states."""
    stated = stated or TorqueChannel(meaning)
    same = stated.meaning == meaning
    try:
        seconds = (stated.delay if same else 0.0) if delay is None or delay in DELAYS else float(delay)
    except ValueError:
        raise ExperimentError(f"--torque-delay {delay} must be seconds, such as 0.002, or estimate, or joints") from None
    if not abs(seconds) < LATEST:
        raise ExperimentError(
            f"a torque delay of {seconds:g} s is impossible: it must be below {LATEST:g} s in size; is it in ms or in samples? "
            "Write s, such as --torque-delay 0.002, or let --torque-delay estimate find it"
        )
    lags = stated.lags if same and delay is None else ()
    return replace(stated, meaning=meaning, delay=seconds, period=stated.period if same else None, lags=lags)
