import sys

import numpy as np
import pyarrow as pa
import pytest
from pyarrow import parquet

from idbench.identify import IdentificationError, LogError, MotionLog, TorqueChannel
from idbench.identify.files.log_file import read_log, write_log


@pytest.fixture
def written(tmp_path, rng):
    log = MotionLog(100, rng.normal(size=(50, 3)), rng.normal(size=(50, 3)), TorqueChannel("held", 0.0031, (1.0, 2.0, 3.0)))
    write_log(log, tmp_path / "log.parquet")
    return log, tmp_path / "log.parquet"


def test_what_is_written_is_read(written):
    log, path = written
    back = read_log(path)
    assert parquet.read_table(path).column_names == ["t", "q1", "q2", "q3", "tau1", "tau2", "tau3"]
    np.testing.assert_array_equal(back.q, log.q)
    np.testing.assert_array_equal(back.tau, log.tau)
    assert back.torque == log.torque
    assert back.fs == pytest.approx(log.fs, rel=1e-12)


def test_the_caller_may_say_what_the_torque_means(written):
    assert read_log(written[1], TorqueChannel("averaged")).torque.meaning == "averaged"


def test_a_file_that_does_not_say_what_its_torque_means_is_asked(tmp_path):
    path = tmp_path / "foreign.parquet"
    parquet.write_table(pa.table({name: np.arange(9) / 10 for name in ("t", "q1", "tau1")}), path)
    with pytest.raises(LogError, match="does not say what its torque means"):
        read_log(path)
    assert read_log(path, TorqueChannel("held")).n == 1


def test_unusable_files_are_refused(tmp_path, rng):
    with pytest.raises(LogError, match="cannot read the log"):
        read_log(tmp_path / "missing.parquet")
    (tmp_path / "text.parquet").write_text("t,q1\n")
    with pytest.raises(LogError, match="cannot read the log"):
        read_log(tmp_path / "text.parquet")
    runs = MotionLog(100, rng.normal(size=(2, 9, 1)), rng.normal(size=(2, 9, 1)), TorqueChannel("held"))
    with pytest.raises(LogError, match="a file holds one run"):
        write_log(runs, tmp_path / "runs.parquet")


@pytest.mark.parametrize("said", [b"{}", b"text", b"[1]", b'{"meaning": "held", "delay": "x", "gain": 1}'])
def test_a_torque_channel_that_makes_no_sense_is_refused(tmp_path, said):
    table = pa.table({name: np.arange(9) / 10 for name in ("t", "q1", "tau1")}).replace_schema_metadata(
        {b"idbench.torque": said}
    )
    parquet.write_table(table, tmp_path / "log.parquet")
    with pytest.raises(IdentificationError, match=r"torque|delay"):
        read_log(tmp_path / "log.parquet")


ROWS = "0,0.1,0.2\n0.01,0.11,0.21\n0.02,0.12,0.22\n"


@pytest.mark.parametrize(
    "text",
    [
        "t,q1,tau1\n" + ROWS,
        "t;q1;tau1\n" + ROWS.replace(",", ";"),
        "t;q1;tau1\n" + ROWS.replace(",", ";").replace(".", ","),
        "t\tq1\ttau1\n" + ROWS.replace(",", "\t"),
    ],
    ids=["commas", "semicolons", "decimal commas", "tabs"],
)
def test_columns_may_be_separated_as_programs_do(tmp_path, text):
    (tmp_path / "log.csv").write_text(text)
    found = read_log(tmp_path / "log.csv", TorqueChannel("held"))
    np.testing.assert_array_equal(found.q[:, 0], [0.1, 0.11, 0.12])
    np.testing.assert_array_equal(found.tau[:, 0], [0.2, 0.21, 0.22])


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("t,q1,tau1 [N·m]\n".encode("latin-1") + ROWS.encode(), "no UTF-8|invalid UTF8|must have a header"),
        ("t,q1,tau1\n0,0.1,Müll\n".encode("latin-1"), "column tau1 holds .*, not numbers|invalid UTF8"),
    ],
    ids=["latin-1 header", "latin-1 cell"],
)
def test_odd_files_are_told_in_one_line(tmp_path, text, message):
    (tmp_path / "log.csv").write_bytes(text)
    with pytest.raises(LogError, match=message) as found:
        read_log(tmp_path / "log.csv", TorqueChannel("held"))
    assert "\n" not in str(found.value)


def test_without_pyarrow_it_says_what_is_missing(written, monkeypatch):
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    with pytest.raises(LogError, match="pip install pyarrow; or make a MotionLog of your own arrays"):
        read_log(written[1])
