"""ROS bags, of ROS 1 and 2: the messages JointState, read by rosbags (extra `ros`)."""

from pathlib import Path

import numpy as np

from identify.errors import LogError
from identify.files.table import LogTable

JOINT_STATE = "sensor_msgs/msg/JointState"


def read_bag(path: Path) -> LogTable:
    """Return time, position, velocity and effort of the joint states of a bag.

    Where several topics have joint states, their columns begin with the topic. Times are those in the headers of the
    messages, or of recording where the headers have none.
    """
    try:
        from rosbags.highlevel import AnyReader
        from rosbags.typesys import Stores, get_typestore
    except ImportError as error:
        raise LogError(f"{path}: ROS bags are read with rosbags: pip install 'idbench[ros]'") from error
    folder = path.parent if path.suffix in (".db3", ".mcap") and (path.parent / "metadata.yaml").is_file() else path
    try:
        with AnyReader([folder], default_typestore=get_typestore(Stores.ROS2_HUMBLE)) as reader:
            topics = [c for c in reader.connections if c.msgtype == JOINT_STATE]
            if not topics:
                known = ", ".join(sorted({c.msgtype for c in reader.connections})) or "none"
                raise LogError(f"{path} holds no messages {JOINT_STATE}; it holds {known}")
            tables = {
                c.topic: [(stamp, reader.deserialize(raw, c.msgtype)) for _, stamp, raw in reader.messages([c])] for c in topics
            }
    except LogError:
        raise
    except Exception as error:  # rosbags raises what its parsers do
        raise LogError(f"cannot read the log {path} as a ROS bag: {str(error).splitlines()[0]}") from error
    several = len(tables) > 1
    found = [_columns(path, messages, f"{topic}/" if several else "") for topic, messages in tables.items() if messages]
    return LogTable(
        {name: column for columns, _ in found for name, column in columns.items()},
        entries={name: joints for _, entries in found for name, joints in entries.items()},
    )


def _columns(path: Path, messages: list, before: str) -> tuple[dict, dict]:  # type: ignore[type-arg]  # of rosbags
    """Return columns of one topic, and the names of their entries."""
    joints = tuple(messages[0][1].name)
    if any(tuple(message.name) != joints for _, message in messages):
        raise LogError(f"{path}: joint states name different joints from message to message: split them by topic first")
    stamps = np.array([m.header.stamp.sec + 1e-9 * m.header.stamp.nanosec for _, m in messages])
    if not stamps.any():
        stamps = 1e-9 * np.array([stamp for stamp, _ in messages], dtype=np.float64)
    columns = {f"{before}t": stamps - stamps[0]}
    for name in ("position", "velocity", "effort"):
        values = [np.asarray(getattr(message, name), dtype=np.float64) for _, message in messages]
        if all(len(value) == len(joints) for value in values):
            columns[f"{before}{name}"] = np.array(values)
    return columns, {name: joints for name in columns if name != f"{before}t"}
