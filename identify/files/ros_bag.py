"""ROS bags, of ROS 1 and 2: the messages JointState and JointTrajectory, read by rosbags (extra `ros`)."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from idbench.identify.arrays import Array
from idbench.identify.errors import LogError
from idbench.identify.files.table import LogTable

Columns = tuple[dict[str, Array], dict[str, tuple[str, ...]]]
"""Columns of one topic, and the names of their entries."""


def read_bag(path: Path) -> LogTable:
    """Return time, position, velocity and effort of the joints of a bag.

    Joint states are taken, or the points of joint trajectories where there are no states. Where there are both, of one topic
    each, trajectories are the column `command` beside the states. Where several topics have them, their columns begin with the
    topic. Times are those in the headers of the messages, or of recording where the headers have none.
    """
    try:
        from rosbags.highlevel import AnyReader
        from rosbags.typesys import Stores, get_typestore
    except ImportError as error:
        raise LogError(f"{path}: ROS bags are read with rosbags: pip install 'idbench[ros]'") from error
    folder = path.parent if path.suffix in (".db3", ".mcap") and (path.parent / "metadata.yaml").is_file() else path
    try:
        with AnyReader([folder], default_typestore=get_typestore(Stores.ROS2_HUMBLE)) as reader:
            kinds = {c.msgtype for c in reader.connections}
            kind = next((kind for kind in KINDS if kind in kinds), None)
            if kind is None:
                known = ", ".join(sorted(kinds)) or "none"
                raise LogError(f"{path} holds no messages {' or '.join(KINDS)}; it holds {known}")
            every = {
                (c.msgtype, c.topic): [(stamp, reader.deserialize(raw, c.msgtype)) for _, stamp, raw in reader.messages([c])]
                for c in reader.connections
                if c.msgtype in KINDS
            }
    except LogError:
        raise
    except Exception as error:  # rosbags raises what its parsers do
        raise LogError(f"cannot read the log {path} as a ROS bag: {str(error).splitlines()[0]}") from error
    tables = {topic: messages for (of, topic), messages in every.items() if of == kind}
    others = [messages for (of, _), messages in every.items() if of != kind and messages]
    several = len(tables) > 1
    found = [KINDS[kind](path, messages, f"{topic}/" if several else "") for topic, messages in tables.items() if messages]
    if len(found) == 1 and len(others) == 1:
        found.append(_commands(path, next(messages for messages in tables.values() if messages), others[0]))
    return LogTable(
        {name: column for columns, _ in found for name, column in columns.items()},
        entries={name: joints for _, entries in found for name, joints in entries.items()},
    )


def _of_states(path: Path, messages: Sequence[tuple[int, Any]], before: str) -> Columns:
    """Return columns of joint states."""
    joints = _same_joints(path, [message.name for _, message in messages])
    samples = [message for _, message in messages]
    values = {name: [getattr(message, name) for message in samples] for name in ("position", "velocity", "effort")}
    return _columns(before, joints, _stamps(messages), values)


def _of_trajectories(path: Path, messages: Sequence[tuple[int, Any]], before: str) -> Columns:
    """Return columns of the points of joint trajectories, one message after the other."""
    joints = _same_joints(path, [message.joint_names for _, message in messages])
    points = [
        (start, point) for start, (_, message) in zip(_stamps(messages), messages, strict=True) for point in message.points
    ]
    t = np.array([start + _seconds(point.time_from_start) for start, point in points])
    fields = {"position": "positions", "velocity": "velocities", "effort": "effort"}
    values = {name: [getattr(point, field) for _, point in points] for name, field in fields.items()}
    return _columns(before, joints, t, values)


def _commands(path: Path, states: Sequence[tuple[int, Any]], messages: Sequence[tuple[int, Any]]) -> Columns:
    """Return the positions that trajectories command at the times of joint states: held, or between points of a message."""
    joints = _same_joints(path, [message.name for _, message in states])
    named = _same_joints(path, [message.joint_names for _, message in messages])
    if set(named) != set(joints):
        raise LogError(f"{path}: trajectories are of {', '.join(named)}, states of {', '.join(joints)}")
    t, starts = _absolute(states), _absolute(messages)
    points = [(x, point) for x, (_, message) in zip(starts, messages, strict=True) for point in message.points]
    at = np.array([x + _seconds(point.time_from_start) for x, point in points])
    q = np.array([point.positions for _, point in points])[:, [named.index(name) for name in joints]]
    if max(len(message.points) for _, message in messages) > 1:
        return {"command": np.stack([np.interp(t, at, x) for x in q.T], axis=1)}, {"command": joints}
    return {"command": q[np.maximum(np.searchsorted(at, t + 1e-9, side="right") - 1, 0)]}, {"command": joints}


KINDS: dict[str, Callable[[Path, Sequence[tuple[int, Any]], str], Columns]] = {
    "sensor_msgs/msg/JointState": _of_states,
    "trajectory_msgs/msg/JointTrajectory": _of_trajectories,
}
"""What reads the messages of a kind; those that come first are preferred."""


def _same_joints(path: Path, names: Sequence[Sequence[str]]) -> tuple[str, ...]:
    joints = tuple(names[0])
    if any(tuple(each) != joints for each in names):
        raise LogError(f"{path}: messages name different joints: split them by topic first")
    return joints


def _seconds(stamp: Any) -> float:
    return float(stamp.sec + 1e-9 * stamp.nanosec)


def _stamps(messages: Sequence[tuple[int, Any]]) -> Array:
    """Return times of messages [s] since the first: those of their headers, or of recording where these have none."""
    stamps = _absolute(messages)
    return stamps - stamps[0]


def _absolute(messages: Sequence[tuple[int, Any]]) -> Array:
    """Return times of messages [s]: those of their headers, or of recording where these have none."""
    stamps = np.array([_seconds(message.header.stamp) for _, message in messages])
    return stamps if stamps.any() else 1e-9 * np.array([stamp for stamp, _ in messages], dtype=np.float64)


def _columns(before: str, joints: tuple[str, ...], t: Array, values: dict[str, list[Sequence[float]]]) -> Columns:
    """Return the columns that every sample has."""
    columns = {f"{before}t": t}
    for name, samples in values.items():
        if samples and all(len(sample) == len(joints) for sample in samples):
            columns[f"{before}{name}"] = np.array(samples, dtype=np.float64)
    return columns, {name: joints for name in columns if name != f"{before}t"}
