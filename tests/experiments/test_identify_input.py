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


def test_a_log_is_not_judged_on_itself(idbench, logs, tmp_path):
    log = read_log(logs / "first.parquet")
    from idbench.identify.files.log_file import write_log

    write_log(log.part(500, 3000), tmp_path / "part.parquet")
    for other in (logs / "first.parquet", tmp_path / "part.parquet"):
        code, _, err = idbench("identify", logs / "first.parquet", *NEEDED, "--validate", other)
        assert code == 2
        assert "holds the motion that is identified: give another motion" in err


def test_names_in_another_case_are_guessed(idbench, logs):
    code, _, err = idbench("identify", logs / "first.parquet", "--robot", "puma560", "--estimator", "wls")
    assert code == 2
    assert "(did you mean 'WLS'?)" in err


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
    words = "--write-mjcf", "out.xml", "--out", "found", "--no-rerun"
    code, out, err = idbench("identify", logs / "first.parquet", *NEEDED, *words)
    assert code == 2
    assert "--write-mjcf out.xml: link 2 cannot exist; the estimates are printed, and with the logs in found" in err
    assert "Ia6  " in out
    assert "written to found" in out


def test_legs_are_pointed_out(idbench):
    (path,) = [f.locate() for f in files("example-robot-data") or () if str(f).endswith("solo_description/robots/solo12.urdf")]
    code, out, err = idbench("robot", path)
    assert code == 0, err
    assert "on a base that is fixed to the ground" in out
    assert "warning: 4 chains of joints start at the ground" in out


@pytest.mark.parametrize("field", ["damping", "frictionloss", "armature"])
def test_joints_that_would_drive_themselves_are_refused(idbench, tmp_path, field):
    body = f'<joint name="hip" {field}="-0.1"/><geom size="0.1" pos="0.1 0 0"/>'
    (tmp_path / "r.xml").write_text(f"<mujoco><worldbody><body>{body}</body></worldbody></mujoco>")
    code, _, err = idbench("robot", "r.xml")
    assert code == 2
    assert f"joint hip has {field} = -0.1, which must be 0 or above" in err


def test_a_payload_that_no_arm_carries(idbench, tmp_path):
    (tmp_path / "pay.toml").write_text('name = "pay"\ntrajectory = "brisk"\n[payload]\nmass = 1e6\n')
    code, _, err = idbench("run", "pay.toml")
    assert code == 2
    assert "payload.mass = 1000000.0: must be less than or equal to 100000" in err


def test_all_that_is_wrong_in_a_scenario_is_told_at_once(idbench, tmp_path):
    text = 'name = "m"\ndrive = 3\nrobot = 4\n[controller]\nkind = "pdd"\n[encoder]\nkind = "incremental"\nlinez = 3\n'
    (tmp_path / "m.toml").write_text(text)
    code, _, err = idbench("run", "m.toml")
    assert code == 2
    for part in (
        "controller.kind = 'pdd'",
        "drive = 3 must be a table",
        "'encoder.linez'",
        "robot = 4",
        "'trajectory' is missing",
    ):
        assert part in err
    assert "'drive' is missing" not in err


def test_simulations_that_hardly_end_are_asked_about(idbench, tmp_path):
    (tmp_path / "fine.toml").write_text('name = "fine"\ntrajectory = "brisk"\n[physics]\nstep = 1e-9\n')
    code, _, err = idbench("run", "fine.toml")
    assert code == 2
    assert "makes 4.6e+10 physics steps of 1e-09 s: hours or days; if you mean it, add --yes" in err


def test_grids_that_hardly_end_are_refused_at_once(idbench, tmp_path):
    axes = "".join(
        f'[[axes]]\nfield = "friction.{x}"\nlowest = 0.1\nhighest = 1.0\ncount = 10000\n' for x in ("coulomb", "viscous")
    )
    (tmp_path / "g.toml").write_text(f'name = "g"\nquestion = "?"\nscenario = "ideal"\nmotion = "shared"\n{axes}')
    code, _, err = idbench("study", "g.toml", "--yes")
    assert code == 2
    assert "the grid has 100,000,000 combinations, more than 1,000,000" in err


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
