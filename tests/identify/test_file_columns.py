"""What columns of files mean: units, numbered names, temperatures, motors."""

from dataclasses import replace

import numpy as np
import pytest

from idbench.identify import LogError, MotionLog, TorqueChannel
from idbench.identify.data.resample import Repaired
from idbench.identify.files.layout import LogLayout, Source, matching
from idbench.identify.files.log_file import read_log, write_log
from idbench.identify.files.reading import read_columns
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
