"""Logs and robots that are not what they seem are refused or pointed out in one line that says the likely cause."""

from importlib.metadata import files

import numpy as np
import pytest

from idbench.experiments.cli import main
from idbench.identify import MotionLog
from idbench.identify.files.log_file import read_log, write_log

NEEDED = "--robot", "puma560", "--model", "explicit"


@pytest.fixture
def as_csv(logs, tmp_path):
    """Write the first log as CSV with columns changed."""

    def write(t=lambda t: t, q=lambda q: q, tau=lambda tau: tau):
        log = read_log(logs / "first.parquet")
        names = ["t", *(f"{x}{j + 1}" for x in ("q", "tau") for j in range(6))]
        columns = np.column_stack([t(log.t), q(log.q), tau(log.tau)])
        np.savetxt(tmp_path / "log.csv", columns, delimiter=",", header=",".join(names), comments="", fmt="%.9g")
        return tmp_path / "log.csv"

    return write


def test_times_in_milliseconds(idbench, as_csv):
    code, _, err = idbench("identify", as_csv(t=lambda t: 1e3 * t), *NEEDED, "--torque", "held")
    assert code == 2
    assert "has a sample every 4 s, if t is in s: is it in ms, us or ns?" in err


@pytest.mark.thorough
def test_wrapped_angles_are_refused_and_unwrapped_when_asked(idbench, as_csv):
    def wrapped(q):
        shifted = q + [0, 0, 0, np.pi, 0, 0]  # counted from another zero, joint 4 crosses the end of a turn
        return (shifted + np.pi) % (2 * np.pi) - np.pi - [0, 0, 0, np.pi, 0, 0]

    path = as_csv(q=wrapped)
    code, _, err = idbench("identify", path, *NEEDED, "--torque", "held")
    assert code == 2
    assert " jumps from " in err
    assert "Add --unwrap to count the turns" in err
    code, _, err = idbench("identify", path, *NEEDED, "--torque", "held", "--unwrap")
    assert code == 0, err


def test_torques_that_are_zero_throughout(idbench, as_csv):
    code, _, err = idbench("identify", as_csv(tau=lambda tau: 0 * tau), *NEEDED, "--torque", "held")
    assert code == 2
    assert "all torques are 0: there is nothing to identify" in err


@pytest.mark.thorough
def test_one_models_failure_takes_nothing_from_the_others(idbench, logs, tmp_path):
    """A seventh of the log leaves the power model fewer rows than parameters; the explicit one has six times as many."""
    from idbench.identify.files.log_file import write_log

    log = read_log(logs / "first.parquet")
    write_log(log.part(0, int(0.14 * log.samples)), tmp_path / "short.parquet")
    code, out, err = idbench("identify", "short.parquet", "--robot", "puma560", "--out", "found", "--no-rerun", "--cutoff", "5")
    assert code == 0, err
    assert "power: no estimate: " in out
    assert "rows are left" in out
    assert "explicit model, GLS" in out


@pytest.mark.thorough
def test_a_file_that_cannot_be_written_costs_nothing_else(idbench, logs, monkeypatch):
    from idbench.identify import IdentificationError

    def impossible(*args, **settings):
        raise IdentificationError("link 2 cannot exist")

    monkeypatch.setattr("idbench.experiments.identification.consistent_estimate.consistent_parameters", impossible)
    words = "--write", "out.xml", "--out", "found", "--no-rerun"
    code, out, err = idbench("identify", logs / "first.parquet", *NEEDED, *words)
    assert code == 2
    assert "--write out.xml: link 2 cannot exist; the estimates are printed, and with the logs in found" in err
    assert "Ia6  " in out
    assert "written to found" in out


def test_legs_are_pointed_out(idbench):
    (path,) = [f.locate() for f in files("example-robot-data") or () if str(f).endswith("solo_description/robots/solo12.urdf")]
    code, out, err = idbench("robot", path)
    assert code == 0, err
    assert "on a base that is fixed to the ground" in out
    assert "warning: 4 chains of joints start at the ground" in out


def test_a_joint_that_never_moves_does_not_keep_the_others_from_being_recorded(tmp_path, table1, capsys):
    log = table1.log
    q = np.column_stack([log.q[:, 0], np.zeros(log.samples)])
    write_log(MotionLog(log.fs, q, log.tau, log.torque), tmp_path / "still.parquet")
    assert main(["identify", str(tmp_path / "still.parquet"), "--out", str(tmp_path / "found")]) == 0
    assert "joint2 never moves" in capsys.readouterr().out
    assert (tmp_path / "found" / "recording.rrd").is_file()


DEGREES = '[q]\ncolumns = "q*"\nunit = "deg"\n[tau]\ncolumns = "tau*"\n[torque]\nmeaning = "held"\n'


@pytest.mark.thorough
def test_a_held_out_log_elsewhere_is_read_as_the_fitted_one_is(idbench, logs, tmp_path):
    """In degrees, which nothing beside it says; Parquet of idbench says itself that it is in rad."""
    for name, folder in (("first", "fitted"), ("second", "elsewhere")):
        log = read_log(logs / f"{name}.parquet")
        (tmp_path / folder).mkdir()
        columns = np.column_stack([log.t, np.rad2deg(log.q), log.tau])
        names = ",".join(["t", *(f"{x}{j + 1}" for x in ("q", "tau") for j in range(6))])
        np.savetxt(tmp_path / folder / "log.csv", columns, delimiter=",", header=names, comments="", fmt="%.9g")
    (tmp_path / "fitted" / "log.toml").write_text(DEGREES)
    errors = []
    for held_out in ("elsewhere/log.csv", str(logs / "second.parquet")):
        code, out, err = idbench("identify", "fitted/log.csv", *NEEDED, "--validate", held_out)
        assert code == 0, err
        assert ("columns are what log.toml beside log.csv says" in out) == held_out.startswith("elsewhere")
        errors.append(next(float(line.split()[1]) for line in out.splitlines() if line.startswith("joint1")))
    assert errors[0] == pytest.approx(errors[1], rel=0.1)  # held and averaged torques differ a little, degrees would by 57
