"""Logs as other software writes them: each kind of file gives back what was put in."""

import gzip
import sys
from dataclasses import replace

import numpy as np
import pyarrow as pa
import pytest
import scipy
from pyarrow import parquet

from identify import LogError
from identify.files.guess import guess
from identify.files.layout import LogLayout, Source, matching
from identify.files.reading import read_columns
from identify.files.units import factor, named_unit

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
    found = guess(path)
    columns = read_columns(path, found.layout)
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
    layout = guess(path).layout
    (path.with_suffix("") if path.suffix == ".gz" else path).with_suffix(".toml").write_text(layout.text)
    columns = read_columns(path)
    np.testing.assert_allclose(columns.q, Q, atol=1e-9)
    assert (columns.joints == ("base", "elbow", "wrist")) == (name in ("tabs.tsv", "bag"))


def test_currents_ask_for_a_gain(tmp_path):
    path = tmp_path / "log.csv"
    text(path, ["t", *(f"q{j}" for j in (1, 2, 3)), *(f"current_{j}" for j in (1, 2, 3))], [T, Q, TAU / 5])
    layout = guess(path).layout
    assert layout.tau.unit == "A"
    with pytest.raises(LogError, match=r"efforts in A are no torques: state gain"):
        read_columns(path, layout)
    np.testing.assert_allclose(read_columns(path, replace(layout, gain=(5.0,))).tau, TAU)
    with pytest.raises(LogError, match="2 gains for 3 joints"):
        read_columns(path, replace(layout, gain=(5.0, 5.0)))


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


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("[q]\ncolums = 1", r"colums in \[q\] is unknown; known: columns, unit, file, t, fs"),
        ('[q]\nunit = "inch"', "unit 'inch' of q is unknown; known: rad, deg"),
        ("[torque]\ndelay = 0.1", "a delay and no meaning"),
        ("[t", "log.toml"),
        ('[q]\ncolumns = "nothing*"', r"has no columns nothing\*; its columns: t, q1"),
        ('[tau]\ncolumns = "gone"', "has no column 'gone'; its columns"),
        ('[tau]\ncolumns = ["tau1", "tau2"]', "3 columns of positions and 2 of torques"),
        ("[rows]\nt = 100.0", "t is 100 in no row; it goes from 0 to"),
    ],
)
def test_a_layout_that_makes_no_sense_is_told_in_one_line(tmp_path, content, message):
    text(tmp_path / "log.csv", numbered("q", "tau"), [T, Q, TAU])
    (tmp_path / "log.toml").write_text(content)
    with pytest.raises(LogError, match=message) as found:
        read_columns(tmp_path / "log.csv")
    assert "\n" not in str(found.value)


@pytest.mark.parametrize("name", ["x.npz", "x.npy", "x.mat", "x.parquet", "x.bag", "x.db3", "x.csv.gz"])
def test_files_that_are_something_else_are_told_in_one_line(tmp_path, name):
    (tmp_path / name).write_bytes(b"\x00no log\xff" * 20)
    with pytest.raises(LogError) as found:
        read_columns(tmp_path / name)
    assert "\n" not in str(found.value)


def test_a_bag_without_rosbags_says_what_is_missing(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "rosbags.highlevel", None)
    (tmp_path / "x.mcap").write_bytes(b"")
    with pytest.raises(LogError, match=r"pip install 'idbench\[ros\]'"):
        read_columns(tmp_path / "x.mcap")


def test_no_pickle_is_loaded(tmp_path):
    np.save(tmp_path / "x.npy", np.array([{"a": 1}], dtype=object), allow_pickle=True)
    with pytest.raises(LogError, match="cannot read the log"):
        read_columns(tmp_path / "x.npy")


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
