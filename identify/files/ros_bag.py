"""ROS bags: messages that hold positions, velocities and efforts of joints, found by their fields."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from idbench.identify.arrays import Array
from idbench.identify.errors import LogError
from idbench.identify.files.ros_text import of_most_joints
from idbench.identify.files.table import LogTable

STATE = {"position": "positions", "velocity": "velocities", "effort": "effort"}  # One sample, and of a point of a trajectory
MEASURED, WANTED = ("feedback", "actual"), ("reference", "desired")  # Fields of controllers' states, in ROS 2 and before
MOTORS = ("motor_state", "motorState")  # Of messages of legs; each has q, dq, tau_est


@dataclass(frozen=True)
class Sample:
    """What a message says of one instant."""

    joints: tuple[str, ...]
    """Names of the joints; numbers where it has none."""
    values: dict[str, list[float]]
    """Columns, joint by joint."""
    after: float = 0.0
    """Time after that of the message [s]."""


def _sample(joints: Sequence[str], values: Mapping[str, Sequence[float]], after: float = 0.0) -> Sample:
    return Sample(tuple(joints), {name: list(x) for name, x in values.items() if len(x) == len(joints)}, after)


def _states(message: Any) -> Iterator[Sample]:
    yield _sample(message.name, {name: getattr(message, name) for name in STATE})


def _controllers(message: Any) -> Iterator[Sample]:
    measured, wanted = (next(getattr(message, x) for x in names if hasattr(message, x)) for names in (MEASURED, WANTED))
    values = {name: getattr(measured, field) for name, field in STATE.items()}
    yield _sample(message.joint_names, {**values, "command": wanted.positions})


def _interfaces(message: Any) -> Iterator[Sample]:
    each = [dict(zip(x.interface_names, x.values, strict=True)) for x in message.interface_values]
    driven = [k for k, one in enumerate(each) if {"position", "effort"} <= set(one)]  # others are sensors
    values = {name: [each[k][name] for k in driven if name in each[k]] for name in STATE}
    yield _sample([message.joint_names[k] for k in driven], values)


def _motors(message: Any) -> Iterator[Sample]:
    motors = next(getattr(message, name) for name in MOTORS if hasattr(message, name))
    fields = zip(STATE, ("q", "dq", "tau_est"), strict=True)
    yield _sample([str(k) for k in range(len(motors))], {name: [getattr(x, field) for x in motors] for name, field in fields})


def _points(message: Any) -> Iterator[Sample]:
    for point in message.points:
        values = {name: getattr(point, field) for name, field in STATE.items()}
        yield _sample(message.joint_names, values, _seconds(point.time_from_start))


def _arrays(message: Any) -> Iterator[Sample]:
    yield _sample([str(k) for k in range(len(message.position))], {name: getattr(message, name, ()) for name in STATE})


READERS: tuple[tuple[tuple[tuple[str, ...], ...], Callable[[Any], Iterator[Sample]]], ...] = (
    ((("name",), ("position",), ("effort",)), _states),
    ((("joint_names",), MEASURED, WANTED), _controllers),
    ((("joint_names",), ("interface_values",)), _interfaces),
    ((MOTORS,), _motors),
    ((("position",), ("effort",)), _arrays),
    ((("joint_names",), ("points",)), _points),
)
"""Fields that a message has, one of each, and what reads it; those that come first are preferred."""


def read_bag(path: Path) -> LogTable:
    """Return time, position, velocity and effort of the joints of a bag, and `command` where it says what is wanted.

    Joint states are taken, or states of controllers, of interfaces or of motors, or else the points of joint trajectories.
    Where there are states and trajectories, of one topic each, trajectories are the column `command` beside the states. Where
    several topics have them, their columns begin with the topic. Times are those in the headers of the messages, or of
    recording where the headers have none.
    """
    try:
        from rosbags.highlevel import AnyReader
        from rosbags.typesys import Stores, get_typestore
    except ImportError as error:
        raise LogError(f"{path}: ROS bags are read with rosbags: pip install 'idbench[ros]'") from error
    folder = path.parent if path.suffix in (".db3", ".mcap") and (path.parent / "metadata.yaml").is_file() else path
    found: dict[int, dict[str, _Topic]] = {}
    try:
        with AnyReader([folder], default_typestore=get_typestore(Stores.ROS2_HUMBLE)) as reader:
            for c in reader.connections:
                every = ((stamp, raw) for _, stamp, raw in reader.messages([c]))
                if (topic := _Topic.of(every, reader.deserialize, c.msgtype)) is not None:
                    found.setdefault(topic.rank, {})[c.topic] = topic
            if not found:
                known = ", ".join(sorted({c.msgtype for c in reader.connections})) or "none"
                raise LogError(
                    f"{path} holds no messages with positions and efforts of joints, such as sensor_msgs/msg/JointState; it "
                    f"holds {known}: record joint states, or write t, q1, ..., tau1, ... as CSV"
                )
    except LogError:
        raise
    except Exception as error:  # rosbags raises what its parsers do
        raise LogError(f"cannot read the log {path} as a ROS bag: {str(error).splitlines()[0]}") from error
    ranks = sorted(found)
    topics, others = found[ranks[0]], [topic for rank in ranks[1:] for topic in found[rank].values()]
    columns, entries = dict[str, Array](), dict[str, tuple[str, ...]]()
    for name, topic in topics.items():
        before = f"{name}/" if len(topics) > 1 else ""
        columns |= {f"{before}t": topic.times - topic.times[0], **{before + x: y for x, y in topic.columns.items()}}
        entries |= dict.fromkeys([before + x for x in topic.columns], topic.joints)
    trajectories = [topic for topic in others if topic.rank == len(READERS) - 1]
    if len(topics) == 1 and len(trajectories) == 1:
        only = next(iter(topics.values()))
        columns["command"], entries["command"] = trajectories[0].commands(path, only), only.joints
    return LogTable(columns, entries=entries, said="; ".join(topic.said for topic in topics.values() if topic.said))


@dataclass(frozen=True, eq=False)
class _Topic:
    """The messages of a topic that are of the same joints."""

    rank: int
    """Place of what reads them in READERS."""
    joints: tuple[str, ...]
    times: Array
    """Absolute [s], shape (sample,)."""
    columns: dict[str, Array]
    """Shape (sample, joint) each."""
    several: bool
    """Whether a message is of several instants."""
    said: str

    @classmethod
    def of(cls, messages: Iterator[tuple[int, Any]], read: Callable[[Any, str], Any], kind: str) -> "_Topic | None":
        """Return the joints' samples of messages; None if they have none, or of a kind that the bag does not describe."""
        stamp, raw = next(messages, (0, None))
        try:
            first = None if raw is None else read(raw, kind)
        except LookupError:
            return None
        fields = {x for x in dir(first) if not isinstance(getattr(first, x), int | float)}  # no single numbers
        rank = next((k for k, (wanted, _) in enumerate(READERS) if all(fields & set(names) for names in wanted)), None)
        if rank is None:  # the others, perhaps of cameras, are not read
            return None
        every = [(stamp, first), *((stamp, read(raw, kind)) for stamp, raw in messages)]
        headers = [getattr(message, "header", None) for _, message in every]
        stamps = np.array([_seconds(header.stamp) if header else 0.0 for header in headers])
        stamps = stamps if stamps.any() else 1e-9 * np.array([stamp for stamp, _ in every], dtype=np.float64)
        samples = [(t, sample) for t, (_, message) in zip(stamps, every, strict=True) for sample in READERS[rank][1](message)]
        if not samples:
            return None
        joints, kept, said = of_most_joints([sample.joints for _, sample in samples])
        whole = max((tuple(samples[k][1].values) for k in kept), key=len)  # messages without some of it are left out
        some = [samples[k] for k in kept if tuple(samples[k][1].values) == whole]
        names, lost = list(whole), len(kept) - len(some)
        said = "; ".join([*([said] if said else []), *([f"{lost} messages lack one of {', '.join(whole)}"] if lost else [])])
        columns = {name: np.array([sample.values[name] for _, sample in some], dtype=np.float64) for name in names}
        times = np.array([t + sample.after for t, sample in some])
        return cls(rank, joints, times, columns, len(samples) > len(every), said)

    def commands(self, path: Path, states: "_Topic") -> Array:
        """Return the positions of trajectories at the times of states: held, or between points of a message."""
        if set(self.joints) != set(states.joints):
            raise LogError(f"{path}: trajectories are of {', '.join(self.joints)}, states of {', '.join(states.joints)}")
        q = self.columns["position"][:, [self.joints.index(name) for name in states.joints]]
        if self.several:
            return np.stack([np.interp(states.times, self.times, x) for x in q.T], axis=1)
        return q[np.maximum(np.searchsorted(self.times, states.times + 1e-9, side="right") - 1, 0)]


def _seconds(stamp: Any) -> float:
    return float(stamp.sec + 1e-9 * stamp.nanosec)
