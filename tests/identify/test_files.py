"""Logs as other software writes them: each kind of file gives back what was put in."""

import gzip
import sys
from dataclasses import replace

import numpy as np
import pyarrow as pa
import pytest
import scipy
from pyarrow import parquet

from idbench.identify import LogError, MotionLog, TorqueChannel
from idbench.identify.files.formats import read_table
from idbench.identify.files.layout import Asked, LogLayout, Source
from idbench.identify.files.log_file import read_log, write_log
from idbench.identify.files.reading import read_columns, understood

T = np.arange(0, 4, 0.01)
Q = np.stack([np.sin(T), 0.5 * np.cos(2 * T), 0.2 * np.sin(3 * T)], axis=1)
QD = np.stack([np.cos(T), -np.sin(2 * T), 0.6 * np.cos(3 * T)], axis=1)
TAU = 10 * Q + 0.1 * np.random.default_rng(0).normal(size=Q.shape)
DEG = 180 / np.pi


def text(path, names, columns, mark=",", before=""):
    rows = "\n".join(mark.join(f"{x:.17g}" for x in row) for row in np.column_stack(columns))
    content = before + (mark.join(names) + "\n" if names else "") + rows + "\n"
    if path.suffix == ".gz":
        path.write_bytes(gzip.compress(content.encode()))
    else:
        path.write_text(content)


def numbered(*letters):
    return ["t", *(f"{letter}{j}" for letter in letters for j in (1, 2, 3))]


def bag(path, efforts=TAU):
    rosbag2 = pytest.importorskip("rosbags.rosbag2")
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_HUMBLE)
    kinds = store.types
    state, header, stamp = (
        kinds[f"{x}"] for x in ("sensor_msgs/msg/JointState", "std_msgs/msg/Header", "builtin_interfaces/msg/Time")
    )
    with rosbag2.Writer(path, version=9) as writer:
        topic = writer.add_connection("/joint_states", state.__msgtype__, typestore=store)
        for t, *values in zip(T + 1.7e9, Q, QD, efforts, strict=True):
            at = stamp(sec=int(t), nanosec=round((t - int(t)) * 1e9))
            message = state(header(at, "base"), ["base", "elbow", "wrist"], *values)
            writer.write(topic, int(t * 1e9), store.serialize_cdr(message, state.__msgtype__))


WRITERS = {
    "a.csv": lambda p: text(p, [x if x != "t" else "time" for x in numbered("q", "tau")], [T, Q, TAU]),
    "degrees.csv": lambda p: text(
        p, ["time [ms]", *(f"J{j} {x}" for x in ("pos [deg]", "trq [Nm]") for j in (1, 2, 3))], [T * 1e3, Q * DEG, TAU]
    ),
    "no-header.csv": lambda p: text(p, None, [T, Q, QD, TAU], ";"),
    "blanks.txt": lambda p: text(p, None, [T, Q, TAU], " "),
    "tabs.tsv": lambda p: text(
        p,
        ["timestamp", *(f"{x}_{j}" for x in ("position", "velocity", "effort") for j in ("base", "elbow", "wrist"))],
        [np.round((T + 1.7e9) * 1e9), Q, QD, TAU],
        "\t",
    ),
    "packed.csv.gz": lambda p: text(p, numbered("q", "tau"), [T, Q, TAU]),
    "comment.csv": lambda p: text(p, None, [T, Q * DEG, QD * DEG, TAU], " ", "# by a recorder\n"),
    "arrays.npz": lambda p: np.savez(p, time=T, joint_pos=Q, joint_vel=QD, joint_torque=TAU),
    "table.npy": lambda p: np.save(p, np.column_stack([T, Q, TAU])),
    "matlab.mat": lambda p: scipy.io.savemat(p, {"data": {"t": T, "q": Q.T, "dq": QD.T, "tau": TAU.T}}),
    "episodes.parquet": lambda p: parquet.write_table(
        pa.table(
            {
                "timestamp": np.concatenate([T, T]),
                "observation.state": list(Q) + list(-Q),
                "observation.velocity": list(QD) + list(-QD),
                "observation.effort": list(TAU) + list(-TAU),
                "action": list(Q) + list(Q),
                "episode_index": np.repeat([0, 1], len(T)),
            }
        ),
        p,
    ),
    "bag": bag,
}


@pytest.mark.parametrize("name", WRITERS)
def test_every_kind_of_file_is_understood(name, tmp_path):
    """Guessed from names and values: degrees, ms, ns, blanks, no header, entries, episodes."""
    path = tmp_path / name
    WRITERS[name](path)
    found = understood(path)
    columns = read_columns(path, Asked(found.files.layout))
    # Stamps since 1970 in ns have a resolution of 0.2 us as floats.
    np.testing.assert_allclose(columns.t - columns.t[0], T, atol=1e-6)
    np.testing.assert_allclose(columns.q, Q, atol=1e-9)
    np.testing.assert_allclose(columns.tau, TAU, atol=1e-9)
    if columns.qd is not None:
        np.testing.assert_allclose(columns.qd, QD, atol=1e-9)


@pytest.mark.parametrize("name", WRITERS)
def test_what_is_written_beside_a_log_is_how_it_is_read(name, tmp_path):
    """The text of a layout says the same as the layout; nothing is guessed once it is there."""
    path = tmp_path / name
    WRITERS[name](path)
    layout = understood(path).files.layout
    (path.with_suffix("") if path.suffix == ".gz" else path).with_suffix(".toml").write_text(layout.text)
    columns = read_columns(path)
    np.testing.assert_allclose(columns.q, Q, atol=1e-9)
    assert (columns.joints == ("base", "elbow", "wrist")) == (name in ("tabs.tsv", "bag"))


def test_joints_some_of_whose_names_have_numbers(tmp_path):
    """A UR's: elbow beside wrist_1 and wrist_2; torques in another order are put right."""
    names = "elbow_joint", "wrist_1_joint", "wrist_2_joint"
    heads = ["t", *(f"q_{name}" for name in names), *(f"tau_{name}" for name in reversed(names))]
    text(tmp_path / "log.csv", heads, [T, Q, TAU[:, ::-1]])
    found = understood(tmp_path / "log.csv")
    assert found.files.layout.joints == names
    columns = read_columns(tmp_path / "log.csv", Asked(found.files.layout))
    np.testing.assert_array_equal(columns.q, Q)
    np.testing.assert_array_equal(columns.tau, TAU)


def test_currents_ask_for_a_gain(tmp_path):
    path = tmp_path / "log.csv"
    text(path, ["t", *(f"q{j}" for j in (1, 2, 3)), *(f"current_{j}" for j in (1, 2, 3))], [T, Q, TAU / 5])
    layout = understood(path).files.layout
    assert layout.tau.unit == "A"
    with pytest.raises(LogError, match=r"tau is in A, no torque: say its gain"):
        read_columns(path, Asked(layout))
    np.testing.assert_allclose(read_columns(path, Asked(replace(layout, gain=(5.0,)))).tau, TAU)
    with pytest.raises(LogError, match="2 gains for 3 joints"):
        read_columns(path, Asked(replace(layout, gain=(5.0, 5.0))))


def test_positions_and_efforts_may_be_in_two_files_with_times_of_their_own(tmp_path):
    text(tmp_path / "q.csv", numbered("q"), [T, Q])
    late = T[::2] + 0.003
    text(tmp_path / "e.csv", ["stamp", "e1", "e2", "e3"], [late, TAU[::2] * 1e3])
    (tmp_path / "run.toml").write_text(
        '[t]\nfile = "q.csv"\nunit = "s"\n[q]\ncolumns = "q*"\nfile = "q.csv"\n'
        '[tau]\ncolumns = "e*"\nfile = "e.csv"\nt = "stamp"\nunit = "mN m"\n[torque]\nmeaning = "instantaneous"\n'
    )
    columns = read_columns(tmp_path / "run.toml")
    np.testing.assert_allclose(columns.t_tau, late)
    np.testing.assert_allclose(columns.tau, TAU[::2])
    assert columns.torque.meaning == "instantaneous"


def test_two_files_since_1970_keep_what_lies_between_them(tmp_path):
    """Torques that begin half a second later, with as many rows: both count from one instant."""
    text(tmp_path / "q.csv", numbered("q"), [T + 1.7e9, Q])
    text(tmp_path / "e.csv", ["stamp", "e1", "e2", "e3"], [T + 1.7e9 + 0.5, TAU])
    (tmp_path / "run.toml").write_text(
        '[t]\nfile = "q.csv"\n[q]\ncolumns = "q*"\nfile = "q.csv"\n[tau]\ncolumns = "e*"\nfile = "e.csv"\nt = "stamp"\n'
    )
    columns = read_columns(tmp_path / "run.toml")
    np.testing.assert_allclose(columns.t_tau - columns.t, 0.5, atol=1e-6)
    with pytest.raises(LogError, match="times of their own"):
        read_log(tmp_path / "run.toml", TorqueChannel("held"))


def test_joints_are_in_the_order_that_is_stated(tmp_path):
    text(tmp_path / "log.csv", ["t", "q_b", "q_a", "tau_a", "tau_b"], [T, Q[:, :2], TAU[:, :2]])
    (tmp_path / "log.toml").write_text('joints = ["a", "b"]\n')
    columns = read_columns(tmp_path / "log.csv")
    np.testing.assert_array_equal(columns.q, Q[:, [1, 0]])
    np.testing.assert_array_equal(columns.tau, TAU[:, :2])
    (tmp_path / "log.toml").write_text('joints = ["a", "c"]\n')
    with pytest.raises(LogError, match="columns of q are of b, a, where joints are a, c"):
        read_columns(tmp_path / "log.csv")


def test_a_layout_of_a_folder_is_not_for_what_idbench_wrote_there(tmp_path):
    log = MotionLog(100.0, Q, TAU, TorqueChannel("held"))
    write_log(log, tmp_path / "made.parquet")
    (tmp_path / "log.toml").write_text('[q]\ncolumns = "q*"\nunit = "deg"\n')
    np.testing.assert_array_equal(read_columns(tmp_path / "made.parquet").q, Q)
    # Nor is the description of a robot, or a scenario, that has the name of a log.
    text(tmp_path / "arm.csv", numbered("q", "tau"), [T, Q, TAU])
    (tmp_path / "log.toml").unlink()
    (tmp_path / "arm.toml").write_text('angles = "deg"\n[[joints]]\nd = 1.0\n')
    np.testing.assert_array_equal(read_columns(tmp_path / "arm.csv").q, Q)


@pytest.mark.parametrize(
    ("content", "names"),
    [
        (b"\xef\xbb\xbft,q1,tau1\n0,1,2\n1,2,3\n", ["t", "q1", "tau1"]),
        (b"\xef\xbb\xbf0,1,2\n1,2,3\n", ["1", "2", "3"]),
        (b"0,nan,2\n1,2,3\n", ["1", "2", "3"]),
        (b"0,0\t1,5\t2,5\n1,0\t2,5\t3,5\n", ["1", "2", "3"]),
        (b"0,0 1,5 2,5\n1,0 2,5 3,5\n", ["1", "2", "3"]),
        (b"% made by a recorder\nt q1 tau1\n0 1 2\n1 2 3\n", ["t", "q1", "tau1"]),
    ],
    ids=["mark", "mark, no names", "nan", "tabs, commas", "blanks, commas", "comment"],
)
def test_dialects_of_text(tmp_path, content, names):
    (tmp_path / "x.txt").write_bytes(content)
    table = read_table(tmp_path / "x.txt")
    assert list(table.columns) == names
    assert table.rows == 2
    assert all((len(column) == 2 and column[1] > column[0]) or np.isnan(column[0]) for column in table.columns.values())


def test_q_is_not_qd_and_arrays_of_some_columns_are_taken(tmp_path):
    text(tmp_path / "log.csv", ["time", *numbered("q", "qd", "tau")[1:]], [T, Q, QD, TAU])
    layout = LogLayout(t=Source(("time",)))
    np.testing.assert_array_equal(read_columns(tmp_path / "log.csv", Asked(layout)).q, Q)
    np.savez(tmp_path / "log.npz", t=T, q_left=Q[:, :2], q_right=Q[:, 2:], tau_all=TAU, note=np.array({"a": 1}, dtype=object))
    found = read_columns(tmp_path / "log.npz", Asked(LogLayout(q=Source(("q_*",)), tau=Source(("tau_*",)))))
    np.testing.assert_array_equal(found.q, Q)


@pytest.mark.parametrize(
    "write",
    [
        lambda p: p.with_suffix(".csv").write_text("0,1,2,3\n"),
        lambda p: np.savez(p.with_suffix(".npz"), t=T, q1=T, q2=T[:9], tau=TAU),
        lambda p: np.save(p.with_suffix(".npy"), np.array([["a", "b"]] * 20)),
    ],
    ids=["one row, no names", "ragged", "words"],
)
def test_what_cannot_be_guessed_is_told_in_one_line(tmp_path, write):
    write(tmp_path / "x")
    (path,) = tmp_path.iterdir()
    with pytest.raises(LogError):
        read_columns(path, Asked(understood(path).files.layout))


@pytest.mark.parametrize("name", ["x.npz", "x.npy", "x.mat", "x.parquet", "x.bag", "x.db3", "x.csv.gz"])
def test_files_that_are_something_else_are_told_in_one_line(tmp_path, name):
    (tmp_path / name).write_bytes(b"\x00no log\xff" * 20)
    with pytest.raises(LogError) as found:
        read_columns(tmp_path / name)
    assert "\n" not in str(found.value)


UNDOUBTED = ("a.csv", "degrees.csv", "packed.csv.gz", "arrays.npz", "matlab.mat", "bag")


@pytest.mark.parametrize("name", UNDOUBTED)
def test_names_that_leave_no_doubt_need_no_layout(name, tmp_path):
    path = tmp_path / name
    WRITERS[name](path)
    columns = read_columns(path)
    np.testing.assert_allclose(columns.q, Q, atol=1e-9)
    np.testing.assert_allclose(columns.tau, TAU, atol=1e-9)
    assert ("columns by their names: " in columns.said) == (name != "packed.csv.gz")


@pytest.mark.parametrize("name", sorted(set(WRITERS) - set(UNDOUBTED)))
def test_where_there_is_doubt_a_layout_is_needed(name, tmp_path):
    """Nanoseconds and degrees by their size, no names, several runs: idbench log shows what is likely; nothing is assumed."""
    path = tmp_path / name
    WRITERS[name](path)
    with pytest.raises(LogError):
        read_columns(path)


def test_a_bag_without_rosbags_says_what_is_missing(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "rosbags.highlevel", None)
    (tmp_path / "x.mcap").write_bytes(b"")
    with pytest.raises(LogError, match=r"pip install 'idbench\[ros\]'"):
        read_columns(tmp_path / "x.mcap")


def test_no_pickle_is_loaded(tmp_path):
    np.save(tmp_path / "x.npy", np.array([{"a": 1}], dtype=object), allow_pickle=True)
    with pytest.raises(LogError, match="cannot read the log"):
        read_columns(tmp_path / "x.npy")
