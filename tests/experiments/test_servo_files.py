"""Files of servos: what is stated, and logs of every format, each in a process of its own."""

import json
import subprocess
import sys
from types import SimpleNamespace

import numpy as np
import pyarrow as pa
import pyarrow.csv
import pytest
import scipy.io
from pyarrow import parquet

from idbench.identify import LogError
from idbench.identify.files.layout import Asked
from idbench.identify.files.servo_file import ServoFile
from idbench.identify.files.servo_log import read_servo_log

NAMES = ("shoulder", "elbow")


@pytest.fixture
def data():
    t = np.arange(60) / 50
    q = 0.3 * np.sin(np.outer(t, [1.0, 2.0]))
    return t, q, q + 0.1


def table(t, q, command, names=("q", "command"), prefix="t"):
    columns = [prefix, *(f"{names[0]}_{name}" for name in NAMES), *(f"{names[1]}_{name}" for name in NAMES)]
    return columns, np.column_stack([t, q, command])


def text(path, columns, values, fmt="%.10g"):
    np.savetxt(path, values, delimiter=",", header=",".join(columns), comments="", fmt=fmt)


def lerobot(folder, t, q, command, kind, twice=False):
    """Write a data set of LeRobot, its action before its times, in degrees."""
    (folder / "meta").mkdir(parents=True)
    (folder / "data" / "chunk-000").mkdir(parents=True)
    features = {name: {"names": [f"{joint}.pos" for joint in NAMES]} for name in ("action", "observation.state")}
    (folder / "meta" / "info.json").write_text(json.dumps({"features": features}))
    times = np.concatenate([t, t]) if twice else t
    rows = {
        name: np.rad2deg(np.concatenate([x, x]) if twice else x) for name, x in (("action", command), ("observation.state", q))
    }
    columns = {name: pa.array([list(map(float, row)) for row in x], kind) for name, x in rows.items()}
    columns |= {"timestamp": pa.array(times, pa.float32()), "episode_index": pa.array(np.repeat([0, 1], len(t))[: len(times)])}
    parquet.write_table(pa.table(columns), folder / "data" / "chunk-000" / "file-000.parquet")


def write(folder, kind, t, q, command):
    """Write a log of a kind, and return its path and the words that read it."""
    path = folder / f"log.{kind}"
    columns, values = table(t, q, command)
    if kind == "csv":
        text(path, columns, values)
    elif kind == "parquet":
        parquet.write_table(pa.table(dict(zip(columns, values.T, strict=True))), path)
    elif kind == "npz":
        np.savez(path, t=t, q=q, command=command)
    elif kind == "mat":
        scipy.io.savemat(path, {"t": t[:, None], "q": q, "command": command})
    elif kind == "npy":
        np.save(path, values)
        return path, {"t": "1", "q": "2,3", "command": "4,5"}, {}
    else:
        lerobot(folder / "set", t, q, command, {"lists": pa.list_(pa.float64()), "fixed": pa.list_(pa.float32(), 2)}[kind])
        return folder / "set", {}, {"q": "deg", "command": "deg"}
    return path, {}, {}


READ = """
import sys, json
from pathlib import Path
from idbench.identify.files.layout import Asked
from idbench.identify.files.servo_log import read_servo_log
path, columns, units = json.loads(sys.argv[1])
found, _ = read_servo_log(Path(path), Asked(None, {name: tuple(x.split(',')) for name, x in columns.items()}, units))
print(json.dumps([found.t.tolist(), found.q.tolist(), found.command.tolist(), list(found.joints)]))
"""


@pytest.mark.parametrize(
    "kind", ["lists", *(pytest.param(x, marks=pytest.mark.thorough) for x in ("csv", "parquet", "npz", "mat", "npy", "fixed"))]
)
def test_a_fresh_process_reads(tmp_path, data, kind):
    """What another import has loaded must not matter."""
    t, q, command = data
    path, columns, units = write(tmp_path, kind, *data)
    asked = json.dumps([str(path), columns, units])
    done = subprocess.run([sys.executable, "-c", READ, asked], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    np.testing.assert_allclose(found[0], t, atol=1e-6)
    np.testing.assert_allclose(found[1], q, atol=1e-6)
    np.testing.assert_allclose(found[2], command, atol=1e-6)
    assert found[3] in ([], list(NAMES))


@pytest.mark.parametrize("kind", ["csv", "parquet"])
def test_threads_of_arrow_never_wait_for_python(tmp_path, data, kind, monkeypatch):
    """One that does aborts a process that ends meanwhile, once in some hundred (apache/arrow 50482)."""
    given = []
    for module, name in ((pa.csv, "read_csv"), (parquet, "ParquetFile")):
        real = getattr(module, name)
        monkeypatch.setattr(module, name, lambda file, *rest, real=real, **more: given.append(file) or real(file, **more))
    path, columns, units = write(tmp_path, kind, *data)
    read_servo_log(path, Asked(None, {name: tuple(x.split(",")) for name, x in columns.items()}, units))
    assert [isinstance(file, pa.BufferReader) for file in given] == [True]


def test_episodes_are_named(tmp_path, data):
    t, q, command = data
    lerobot(tmp_path / "set", t, q, command, pa.list_(pa.float64()), twice=True)
    with pytest.raises(LogError, match=r"--rows episode_index=0"):
        read_servo_log(tmp_path / "set", Asked(units={"q": "deg", "command": "deg"}))
    found, _ = read_servo_log(tmp_path / "set", Asked(units={"q": "deg", "command": "deg"}, rows={"episode_index": 1.0}))
    np.testing.assert_allclose(found.q, q, atol=1e-6)
    with pytest.raises(LogError, match=r"state its unit.*q=deg"):
        read_servo_log(tmp_path / "set", Asked(rows={"episode_index": 1.0}))


@pytest.mark.parametrize(
    ("times", "said"),
    [("ns", "times in ns"), ("ms", "times in ms"), ("dates", ""), ("time", "")],
)
def test_times_of_any_kind(tmp_path, data, times, said):
    t, q, command = data
    columns, values = table(t, q, command, prefix="time" if times == "time" else "t")
    stamps = {
        "ns": [f"{1_764_000_000_000_000_000 + round(1e9 * x)}" for x in t],
        "ms": [f"{1e3 * x:.6g}" for x in t],
        "dates": [f"2026-11-26 08:00:0{x:.6f}" for x in t],
        "time": [f"{x:.6g}" for x in t],
    }[times]
    lines = [",".join([stamp, *(f"{x:.10g}" for x in row[1:])]) for stamp, row in zip(stamps, values, strict=True)]
    (tmp_path / "log.csv").write_text("\n".join([",".join(columns), *lines]) + "\n")
    found, why = read_servo_log(tmp_path / "log.csv")
    np.testing.assert_allclose(found.t, t, atol=1e-6)
    assert said in why


def test_a_position_that_is_shorter_than_a_command_is_named(tmp_path, data):
    t, q, command = data
    np.savez(tmp_path / "log.npz", t=t, q=q, command=command[:-3])
    with pytest.raises(LogError, match="60 samples of positions and 57 of commands"):
        read_servo_log(tmp_path / "log.npz")


def test_a_torque_loop_knows_its_torques():
    servo = ServoFile({"kind": "torque", "kp": 25, "kd": 0.6, "torque_limit": 23.7}, {}, {}).servo("elbow", "")
    assert servo.held == {"a": 1.0, "b": 0.0}
    assert (servo.slope, servo.kd, servo.limit, servo.count) == (25, 0.6, 23.7, 0.0)


def test_a_bag_has_states_and_what_trajectories_command(tmp_path, data):
    """Trajectories of one point each, joints in another order, the first a tenth of a second late."""
    rosbag2 = pytest.importorskip("rosbags.rosbag2")
    from rosbags.typesys import Stores, get_typestore

    store, (t, q, command) = get_typestore(Stores.ROS2_HUMBLE), data
    kinds = store.types
    state, trajectory, point, header = (
        kinds[x]
        for x in (
            "sensor_msgs/msg/JointState",
            "trajectory_msgs/msg/JointTrajectory",
            "trajectory_msgs/msg/JointTrajectoryPoint",
            "std_msgs/msg/Header",
        )
    )
    stamp, duration = (kinds[f"builtin_interfaces/msg/{name}"] for name in ("Time", "Duration"))

    def at(x):
        return stamp(sec=int(x), nanosec=round((x - int(x)) * 1e9))

    with rosbag2.Writer(tmp_path / "bag", version=9) as writer:
        states, commands = (
            writer.add_connection(topic, kind.__msgtype__, typestore=store)
            for topic, kind in (("/joint_states", state), ("/commands", trajectory))
        )
        none, now = np.zeros(0), duration(sec=0, nanosec=0)
        for x, here, there in zip(t + 1.7e9, q, command, strict=True):
            message = state(header(at(x), ""), list(NAMES), here, none, none)
            writer.write(states, int(x * 1e9), store.serialize_cdr(message, state.__msgtype__))
            if x >= 1.7e9 + 0.1:
                sent = trajectory(header(at(x), ""), list(NAMES[::-1]), [point(there[::-1].copy(), none, none, none, now)])
                writer.write(commands, int(x * 1e9), store.serialize_cdr(sent, trajectory.__msgtype__))
    found, _ = read_servo_log(tmp_path / "bag")
    assert found.joints == NAMES
    np.testing.assert_allclose(found.q, q, atol=1e-9)
    np.testing.assert_allclose(found.command[6:], command[6:], atol=1e-9)


class Arm:
    """Stands for the follower of LeRobot: an observation and an action are tables of `NAME.pos` in degrees."""

    def __init__(self):
        self.at = dict.fromkeys((f"{name}.pos" for name in NAMES), 0.0)

    def get_observation(self):
        return dict(self.at)

    def send_action(self, action):
        assert action.keys() == self.at.keys()
        self.at = dict(action)


def test_the_player_of_the_page_writes_a_log_that_is_read(root, tmp_path, data, monkeypatch):
    t, _, command = data
    page = (root / "docs" / "so101.md").read_text()
    code = page.split("```python\n")[1].split("```")[0]
    follower = SimpleNamespace(SO101Follower=Arm, SO101FollowerConfig=SimpleNamespace)
    for name in ("lerobot", "lerobot.robots", "lerobot.robots.so_follower"):
        monkeypatch.setitem(sys.modules, name, follower)
    scope = {"__name__": "play"}
    exec(compile(code, "play.py", "exec"), scope)
    text(tmp_path / "commands.csv", ["t", *(f"command_{name}" for name in NAMES)], np.column_stack([t, command])[:15])
    scope["play"](Arm(), tmp_path / "commands.csv", tmp_path / "log.csv")
    found, _ = read_servo_log(tmp_path / "log.csv", Asked(units={"q": "deg", "command": "deg"}))
    assert found.joints == NAMES
    np.testing.assert_allclose(found.command, command[:15], atol=1e-6)
    np.testing.assert_allclose(found.q[1:], command[:14], atol=1e-6)  # what was commanded is seen before the next command
    assert np.abs(found.t - t[:15]).max() < 1.0
