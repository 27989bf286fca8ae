"""Logs that are read without a description, and those whose columns leave a doubt."""

import numpy as np
import pytest

from idbench.identify import LogError
from idbench.identify.files.guess import guess
from idbench.identify.files.reading import read_columns

T = np.arange(0, 1, 0.01)
Q = 0.5 * np.sin(np.outer(T, [1.0, 2.0, 3.0]))
QD = 0.5 * np.array([1.0, 2.0, 3.0]) * np.cos(np.outer(T, [1.0, 2.0, 3.0]))
TAU = 2 * Q + QD


def trajectory_bag(path):
    """Write all points of a motion into one message of a trajectory."""
    rosbag2 = pytest.importorskip("rosbags.rosbag2")
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_HUMBLE)
    names = ("trajectory_msgs/msg/JointTrajectory", "trajectory_msgs/msg/JointTrajectoryPoint", "std_msgs/msg/Header")
    trajectory, point, header = (store.types[name] for name in names)
    stamp, duration = (store.types[f"builtin_interfaces/msg/{name}"] for name in ("Time", "Duration"))
    after = [duration(sec=int(t), nanosec=round((t - int(t)) * 1e9)) for t in T]
    none = np.zeros(0)
    points = [point(q, qd, none, tau, t) for t, q, qd, tau in zip(after, Q, QD, TAU, strict=True)]
    with rosbag2.Writer(path, version=9) as writer:
        topic = writer.add_connection("/executed", trajectory.__msgtype__, typestore=store)
        message = trajectory(header(stamp(sec=0, nanosec=0), "base"), ["base", "elbow", "wrist"], points)
        writer.write(topic, 1, store.serialize_cdr(message, trajectory.__msgtype__))


def test_points_of_a_trajectory_are_a_log(tmp_path):
    trajectory_bag(tmp_path / "bag")
    columns = read_columns(tmp_path / "bag")
    assert columns.joints == ("base", "elbow", "wrist")
    for values, expected in ((columns.t, T), (columns.q, Q), (columns.qd, QD), (columns.tau, TAU)):
        np.testing.assert_allclose(values, expected, atol=1e-9)


def test_two_groups_of_positions_are_a_doubt(tmp_path):
    names = ["t", *(f"{x}_{j}" for x in ("joint_position", "motor_position", "effort") for j in (1, 2, 3))]
    np.savetxt(tmp_path / "log.csv", np.c_[T, Q, 100 * Q, TAU], delimiter=",", header=",".join(names), comments="")
    assert any("could be meant" in doubt for doubt in guess(tmp_path / "log.csv").doubts)
    with pytest.raises(LogError, match="must have a header"):
        read_columns(tmp_path / "log.csv")


def test_joints_with_other_numbers_are_a_doubt(tmp_path):
    names = ["time", *(f"position_{j}" for j in (1, 2, 3)), *(f"effort_{j}" for j in (2, 3, 4))]
    np.savetxt(tmp_path / "log.csv", np.c_[T, Q, TAU], delimiter=",", header=",".join(names), comments="")
    assert any("the same joints?" in doubt for doubt in guess(tmp_path / "log.csv").doubts)
    with pytest.raises(LogError, match="must have a header"):
        read_columns(tmp_path / "log.csv")
