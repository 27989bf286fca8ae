"""What columns of files mean: units, numbered names, temperatures, motors, and which leave a doubt."""

from dataclasses import replace

import numpy as np
import pytest

from idbench.identify import LogError, MotionLog, SettingError, TorqueChannel
from idbench.identify.data.resample import Repaired
from idbench.identify.files.formats import read_table
from idbench.identify.files.layout import Asked, LogLayout, Source, matching
from idbench.identify.files.log_file import read_log, write_log
from idbench.identify.files.reading import read_columns, understood
from idbench.identify.files.table import factor, named_unit


def test_units_have_one_meaning():
    assert factor("q", "°") == factor("q", "degrees") == pytest.approx(np.pi / 180)
    assert factor("tau", "mNm") == factor("tau", "mN·m") == 1e-3
    assert factor("qd", "deg/s") == pytest.approx(np.pi / 180)
    assert named_unit("q", "J1 pos [deg]") == "deg"
    assert named_unit("tau", "tau1_mNm") == "mN m"
    assert named_unit("q", "q1") == ""


def test_a_star_stands_for_numbers_in_order():
    names = ["t", *(f"q{j}" for j in (10, 2, 1))]
    assert [name for name, _ in matching("q*", names)] == ["q1", "q2", "q10"]
    assert matching("p*", names) == []
    assert LogLayout(q=Source(("x", "y"), "deg")).text.count("deg") == 1


def test_temperatures_are_read_written_and_resampled(tmp_path):
    t = np.arange(0, 4, 0.01)
    q = np.stack([np.sin(t), np.cos(t)], axis=1)
    warm = np.stack([20 + t, 30 + 0 * t], axis=1)
    log = MotionLog(100.0, q, q, TorqueChannel("instantaneous"), {"temperature": warm})
    write_log(log, tmp_path / "warm.csv")
    again = read_log(tmp_path / "warm.csv", TorqueChannel("instantaneous"))
    np.testing.assert_allclose(again.conditions["temperature"], warm)
    columns = replace(read_columns(tmp_path / "warm.csv"), qd=None)
    repaired = Repaired.of(columns, TorqueChannel("instantaneous"), 50.0).logs[0]
    np.testing.assert_allclose(repaired.conditions["temperature"][:, 0], 20 + repaired.t, atol=1e-6)


def test_motors_are_turned_to_joints(tmp_path):
    """Motor 2 turns with both joints: positions by the inverse of the matrix, torques by its transpose; power stays."""
    t = np.arange(0, 2, 0.01)
    q, tau = np.stack([np.sin(t), np.cos(t)], axis=1), np.stack([t, 1 - t], axis=1)
    M = np.array([[100.0, 0.0], [50.0, 50.0]])
    motors, torques = q @ M.T, tau @ np.linalg.inv(M)
    lines = [
        "t,q1,q2,tau1,tau2",
        *(",".join(map(repr, map(float, (s, *a, *b)))) for s, a, b in zip(t, motors, torques, strict=True)),
    ]
    (tmp_path / "run.csv").write_text("\n".join(lines))
    (tmp_path / "log.toml").write_text(
        '[q]\ncolumns = "q*"\n[tau]\ncolumns = "tau*"\n[motors]\nmatrix = [[100, 0], [50, 50]]\n'
    )
    found = read_columns(tmp_path / "run.csv")
    np.testing.assert_allclose(found.q, q, atol=1e-12)
    np.testing.assert_allclose(found.tau, tau, atol=1e-12)
    (tmp_path / "log.toml").write_text("[motors]\nmatrix = [[1, 1], [1, 1]]\n")
    with pytest.raises(LogError, match="must be square and have an inverse"):
        read_columns(tmp_path / "run.csv")
    (tmp_path / "log.toml").write_text("[motors]\nmatrix = [[1]]\n")
    with pytest.raises(LogError, match=r"has 1 rows, the log 2 motors"):
        read_columns(tmp_path / "run.csv")


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


ARM, GRIPPER = ("base", "elbow", "wrist"), ("finger",)
DEFINITIONS = {
    "control_msgs/msg/JointTrajectoryControllerState": (
        "std_msgs/Header header\nstring[] joint_names\ntrajectory_msgs/JointTrajectoryPoint reference\n"
        "trajectory_msgs/JointTrajectoryPoint feedback"
    ),
    "control_msgs/msg/InterfaceValue": "string[] interface_names\nfloat64[] values",
    "control_msgs/msg/DynamicJointState": (
        "std_msgs/Header header\nstring[] joint_names\ncontrol_msgs/InterfaceValue[] interface_values"
    ),
    "legs/msg/MotorState": "float32 q\nfloat32 dq\nfloat32 tau_est",
    "legs/msg/LowState": "legs/MotorState[3] motor_state",
    "own/msg/Arm": "float64[] position\nfloat64[] effort",
}


def rows_of(kind, store, header):
    """Return messages of each instant, of a kind."""
    point = store.types["trajectory_msgs/msg/JointTrajectoryPoint"]
    none, after = np.zeros(0), store.types["builtin_interfaces/msg/Duration"](sec=0, nanosec=0)
    made = store.types[kind]
    for t, q, qd, tau in zip(T, Q, QD, TAU, strict=True):
        head = header(t)
        if kind.endswith("JointState") and "Dynamic" not in kind:
            yield t, made(head, list(ARM), q, qd, tau)
            if round(100 * t) % 5 == 0:
                yield t, made(head, list(GRIPPER), q[:1], qd[:1], tau[:1])
        elif "Controller" in kind:
            yield t, made(head, list(ARM), point(q + 0.01, qd, none, none, after), point(q, qd, none, tau, after))
        elif "Dynamic" in kind:
            each = store.types["control_msgs/msg/InterfaceValue"]
            names = ["effort", "position", "velocity"]
            yield t, made(head, list(ARM), [each(names, np.array(x)) for x in zip(tau, q, qd, strict=True)])
        elif "LowState" in kind:
            yield t, made([store.types["legs/msg/MotorState"](*map(float, x)) for x in zip(q, qd, tau, strict=True)])
        else:
            yield t, made(q, tau)


@pytest.mark.parametrize(
    "kind", ["sensor_msgs/msg/JointState", *[x for x in DEFINITIONS if not x.endswith(("Value", "MotorState"))]]
)
def test_messages_are_read_by_their_fields(kind, tmp_path):
    rosbag2 = pytest.importorskip("rosbags.rosbag2")
    from rosbags.typesys import Stores, get_types_from_msg, get_typestore

    store = get_typestore(Stores.ROS2_HUMBLE)
    for name, text in DEFINITIONS.items():
        store.register(get_types_from_msg(text, name))
    stamp = store.types["builtin_interfaces/msg/Time"]

    def header(t):
        return store.types["std_msgs/msg/Header"](stamp(sec=1000 + int(t), nanosec=round((t - int(t)) * 1e9)), "base")

    with rosbag2.Writer(tmp_path / "bag", version=9) as writer:
        topic = writer.add_connection("/topic", kind, typestore=store)
        for t, message in rows_of(kind, store, header):
            writer.write(topic, round(1e9 * (1000 + t)), store.serialize_cdr(message, kind))
    table, columns = read_table(tmp_path / "bag"), read_columns(tmp_path / "bag")
    single = 1e-6 if "LowState" in kind else 1e-9  # numbers of single precision
    for values, expected in ((columns.t, T), (columns.q, Q), (columns.tau, TAU)):
        np.testing.assert_allclose(values, expected, atol=single)
    if kind.endswith("/JointState"):
        assert columns.joints == ARM
        assert "20 messages that do not name base, elbow, wrist are left out" in columns.said
    if "Controller" in kind:
        np.testing.assert_allclose(table.columns["command"], Q + 0.01)


def test_a_file_a_joint_without_names_and_times(tmp_path):
    for j in range(3):
        np.savetxt(tmp_path / f"joint{j + 1}.txt", np.c_[Q[:, j], QD[:, j], TAU[:, j]])
    lines = [
        'file = "joint*.txt"',
        "[t]",
        "fs = 100.0",
        *(f'[{x}]\ncolumns = "{k + 1}"' for k, x in enumerate(("q", "qd", "tau"))),
    ]
    (tmp_path / "arm.toml").write_text("\n".join(lines))
    columns = read_columns(tmp_path / "arm.toml")
    for values, expected in ((columns.t, T), (columns.q, Q), (columns.qd, QD), (columns.tau, TAU)):
        np.testing.assert_allclose(values, expected, atol=1e-12)


@pytest.mark.parametrize("printed", ["rostopic", "ros2"])
def test_messages_that_ros_printed_are_read(printed, tmp_path):
    header = "%time,field.header.seq,field.header.stamp,field.header.frame_id"
    fields = ("name", "position", "velocity", "effort")
    lines = [",".join([header, *(f"field.{x}{j}" for x in fields for j in range(3))])] if printed == "rostopic" else []
    for k, (t, *values) in enumerate(zip(T, Q, QD, TAU, strict=True)):
        ns = 1_700_000_000_000_000_000 + round(1e9 * t)
        stamp = f"{ns + 1234},{k},{ns}," if printed == "rostopic" else f"{ns // 10**9},{ns % 10**9},"
        lines.append(",".join([stamp, *ARM, *(repr(float(x)) for each in values for x in each)]))
    (tmp_path / "log.csv").write_text("\n".join(lines) + "\n")
    columns = read_columns(tmp_path / "log.csv")
    assert columns.joints == ARM
    for values, expected in ((columns.t, T), (columns.q, Q), (columns.qd, QD), (columns.tau, TAU)):
        np.testing.assert_allclose(values, expected, atol=1e-9)


def test_the_table_of_a_drives_trace_is_found_and_what_is_before_it_said(tmp_path):
    rows = [f"{1e3 * t:.3f};{q[0]:.9f};{tau[0]:.9f}".replace(".", ",") for t, q, tau in zip(T, Q, TAU, strict=True)]
    text = ["Drive trace", "Date: 2020-03-16 17:04:51", "Amplifier;MR-J4", "", "Time [ms];Position [rad];Torque [Nm]", *rows]
    (tmp_path / "trace.csv").write_text("\n".join(text) + "\n")
    columns = read_columns(tmp_path / "trace.csv")
    assert "4 lines before its table are passed over" in columns.said
    for values, expected in ((columns.t, T), (columns.q, Q[:, :1]), (columns.tau, TAU[:, :1])):
        np.testing.assert_allclose(values, expected, atol=1e-6)


@pytest.mark.parametrize(
    ("letters", "groups", "doubt"),
    [
        (("joint_position_{}", "motor_position_{}", "effort_{}"), (Q, 100 * Q, TAU), "could be meant"),
        (("position_{}", "effort_{}"), (Q, TAU), "the same joints?"),
    ],
    ids=["two groups of positions", "joints with other numbers"],
)
def test_columns_that_leave_a_doubt_are_asked_for(letters, groups, doubt, tmp_path):
    numbers = [(2, 3, 4) if doubt == "the same joints?" and "effort" in letter else (1, 2, 3) for letter in letters]
    names = ["t", *(letter.format(j) for letter, joints in zip(letters, numbers, strict=True) for j in joints)]
    np.savetxt(tmp_path / "log.csv", np.c_[T, *groups], delimiter=",", header=",".join(names), comments="")
    assert any(doubt in found for found in understood(tmp_path / "log.csv").doubts)
    with pytest.raises(LogError, match=doubt.replace("?", r"\?")):
        read_columns(tmp_path / "log.csv")


def saved(path, names, values):
    np.savetxt(path, values, delimiter=",", header=",".join(names), comments="", fmt="%.12g")
    return path


NAMED = "time,position_turn,position_lift,current_turn,current_lift"


@pytest.fixture
def named(tmp_path):
    """A log whose names leave one doubt: its torques are currents."""
    return saved(tmp_path / "named.csv", NAMED.split(","), np.c_[T, Q[:, :2], TAU[:, :2]])


@pytest.mark.parametrize(
    ("asked", "q", "tau"),
    [
        (Asked(gain=(1.0,)), 1.0, 1.0),
        (Asked(units={"tau": "A"}, gain=(2.0, 2.0)), 1.0, 2.0),
        (Asked(units={"tau": "mA", "t": "s"}, gain=(1.0,)), 1.0, 1e-3),
        (Asked(columns={"tau": ("current_*",)}, units={"tau": "permille:2.4"}), 1.0, 2.4e-3),
        (Asked(columns={"q": ("position_turn", "position_lift")}, units={"tau": "mNm", "q": "deg"}), np.pi / 180, 1e-3),
    ],
    ids=["gain", "units and gain", "mA", "columns and rated torque", "columns and units"],
)
def test_options_change_what_they_name_and_names_hold(named, asked, q, tau):
    found = read_columns(named, asked)
    np.testing.assert_allclose(found.t, T, atol=1e-12)
    np.testing.assert_allclose(found.q, q * Q[:, :2])
    np.testing.assert_allclose(found.tau, tau * TAU[:, :2])


def test_what_is_missing_is_asked_for_with_the_layout_that_may_say_it(named):
    with pytest.raises(LogError, match=r"tau is in A, no torque: say its gain, --gain N m per A.*--write makes .*named\.toml"):
        read_columns(named)


@pytest.mark.parametrize(
    ("unit", "size", "zero"),
    [
        ("count:131072@4194304", 131072 / (2 * np.pi), 4194304),
        ("mrad", 1e3, 0),
        ("deg@180", 180 / np.pi, 180),
        ("rev", 0.5 / np.pi, 0),
    ],
)
def test_positions_in_other_units_are_asked_for_and_read(named, unit, size, zero):
    raw = Q[:, :2] * size + zero
    path = saved(named.parent / "raw.csv", NAMED.replace("current", "torque").split(","), np.c_[T, raw, TAU[:, :2]])
    np.testing.assert_allclose(read_columns(path, Asked(units={"q": unit})).q, Q[:, :2], atol=1e-9)
    if np.abs(raw).max() > 720:
        with pytest.raises(LogError, match=r"q reaches .*: say its unit"):
            read_columns(path)


@pytest.mark.parametrize(
    ("units", "complaint"),
    [
        ({"q": "count"}, "needs the counts of a turn"),
        ({"q": "count:0"}, "above 0"),
        ({"q": "count:x"}, "are numbers"),
        ({"q": "deg:3"}, "has no size"),
        ({"tau": "count:9"}, "is unknown"),
        ({"q": "deg@nan"}, "finite"),
    ],
)
def test_units_that_are_none_are_refused(units, complaint):
    with pytest.raises(SettingError, match=complaint):
        Asked(units=units)


@pytest.mark.parametrize("unit", ["A@0.02", "mA@2", "%@1", "permille@3"])
def test_a_zero_makes_no_torque_of_a_current(named, unit):
    with pytest.raises(LogError, match="say its gain"):
        read_columns(named, Asked(units={"tau": unit}))


def test_columns_that_are_asked_for_give_the_others_their_order(tmp_path):
    names = ["time", "x_elbow", "x_lift", "effort_lift", "effort_elbow", "speed_elbow", "speed_lift"]
    path = saved(tmp_path / "order.csv", names, np.c_[T, Q[:, [1, 0]], TAU[:, :2], QD[:, [1, 0]]])
    found = read_columns(path, Asked(columns={"q": ("x_*",)}))
    place = [found.joints.index(name) for name in ("lift", "elbow")]
    for values, expected in ((found.q, Q[:, :2]), (found.qd, QD[:, :2]), (found.tau, TAU[:, :2])):
        np.testing.assert_allclose(values[:, place], expected)
    one = read_columns(path, Asked(columns={"q": ("x_lift",), "tau": ("effort_lift",)}))
    np.testing.assert_allclose(one.q, Q[:, :1])
    assert one.qd is None


@pytest.mark.parametrize("first", ["NA", "IDLE", ""])
def test_names_are_kept_above_rows_with_words(first, tmp_path):
    rows = [f"{t},{q},{tau},{first if k < 3 else 0.5}" for k, (t, q, tau) in enumerate(zip(T, Q[:, 0], TAU[:, 0], strict=True))]
    (tmp_path / "log.csv").write_text("\n".join(["time,position_a,effort_a,mode", *rows]) + "\n")
    found = read_columns(tmp_path / "log.csv")
    np.testing.assert_allclose(found.q[:, 0], Q[:, 0])


def test_a_gripper_that_printed_first_is_left_out(tmp_path):
    fields = ("name", "position", "velocity", "effort")
    lines = [",".join(["%time,field.header.seq,field.header.stamp,field.header.frame_id", *(f"field.{x}0" for x in fields)])]
    for k, (t, *values) in enumerate(zip(T, Q, QD, TAU, strict=True)):
        stamp = f"{round(1e9 * t)},{k},{1_700_000_000_000_000_000 + round(1e9 * t)},"
        lines += [f"{stamp},finger,0.0,0.0,0.0"] * (k % 10 == 0)
        lines.append(",".join([stamp, *ARM, *(repr(float(x)) for each in values for x in each)]))
    (tmp_path / "log.csv").write_text("\n".join(lines) + "\n")
    found = read_columns(tmp_path / "log.csv")
    assert found.joints == ARM
    assert "10 messages" in found.said
    np.testing.assert_allclose(found.tau, TAU, atol=1e-9)


def test_samples_have_the_units_of_their_positions_or_of_their_names(tmp_path):
    degrees = 180 / np.pi
    names = ["q_a", "qd_a", "acc_a [deg/s^2]", "tau_a"]
    path = saved(tmp_path / "samples.csv", names, np.c_[degrees * Q[:, 0], degrees * QD[:, 0], degrees * Q[:, 1], TAU[:, 0]])
    found = read_columns(path, Asked(units={"q": "deg"}))
    for values, expected in ((found.q, Q[:, 0]), (found.qd, QD[:, 0]), (found.qdd, Q[:, 1])):
        np.testing.assert_allclose(values[:, 0], expected)
