"""Rows by themselves: samples of q, qd, qdd and tau, tables of a friction, poses; and joints that nobody drives."""

import numpy as np
import pytest

from idbench.experiments.identification.job import identified
from idbench.experiments.judgement.judgement import judge
from idbench.experiments.requests.jobs import IdentifyRequest
from idbench.experiments.requests.shared import ColumnOptions, Parameters
from idbench.sim.robot.inverse_dynamics import coulomb_torque, inverse_dynamics
from idbench.sim.robot.robot import Robot

NOISE = 0.02  # [N m]


@pytest.fixture(scope="module")
def samples(tmp_path_factory):
    """Draws of states of the PUMA, and the torques that MuJoCo's inverse dynamics gives them; without times."""
    robot, rng = Robot.load("puma560"), np.random.default_rng(5)
    q, qd, qdd = (size * rng.uniform(-1, 1, (1500, robot.n)) for size in (2.0, 2.0, 8.0))
    tau = inverse_dynamics(robot, q, qd, qdd) + coulomb_torque(robot, qd) + NOISE * rng.normal(size=q.shape)
    names = [f"{name}{j + 1}" for name in ("q", "qd", "qdd", "tau") for j in range(robot.n)]
    path = tmp_path_factory.mktemp("samples") / "samples.csv"
    np.savetxt(path, np.c_[q, qd, qdd, tau], delimiter=",", header=",".join(names), comments="", fmt="%.10g")
    return path


def test_samples_without_times_are_least_squares_of_the_rows_as_they_are(samples):
    fit = identified(IdentifyRequest(log=(samples,), robot="puma560", torque="instantaneous"))
    assert tuple(fit.estimates) == ("explicit",)
    explicit, truth = fit.estimates["explicit"], fit.robot_model.truth(Robot.load("puma560"))
    known = np.array([truth[name] for name in explicit.names])
    off = np.abs(explicit.X - known) / explicit.standard_errors
    assert off.max() < 4.5
    assert 0.6 < np.sqrt(np.mean(off**2)) < 1.4
    assert judge(fit).good
    assert any("samples by themselves" in note for note in fit.logs.notes)


def test_a_table_of_velocities_and_torques_is_a_law_of_friction(tmp_path, idbench):
    robot = Robot.load("two_link")
    speeds = np.linspace(-2, 2, 24)
    speeds = speeds[np.abs(speeds) > 0.1]
    tau = np.c_[3.0 * speeds + 0.7 * np.sign(speeds), 1.5 * speeds + 0.4 * np.sign(speeds)]
    names = [f"{name}{j + 1}" for name in ("velocity", "torque") for j in range(robot.n)]
    table = np.c_[speeds, speeds[::-1], tau[:, 0], tau[::-1, 1]]
    np.savetxt(tmp_path / "table.csv", table, delimiter=",", header=",".join(names), comments="", fmt="%.10g")
    asked = IdentifyRequest(
        log=(tmp_path / "table.csv",), robot="two_link", torque="instantaneous", reading=ColumnOptions(samples=True)
    )
    fit = identified(asked)
    assert judge(fit).good
    found = dict(zip(fit.estimates["explicit"].names, fit.estimates["explicit"].X, strict=True))
    assert [found[x] for x in ("Fv1", "Fs1", "Fv2", "Fs2")] == pytest.approx([3.0, 0.7, 1.5, 0.4], rel=1e-6)


@pytest.mark.parametrize(
    ("words", "complaint"),
    [
        (("--torque-delay", "estimate"), "show no delay"),
        (("--cutoff", "5"), "have no band"),
        (("--model", "implicit"), "have no derivatives in time"),
        (("--estimator", "OE"), "hold no motion"),
    ],
)
def test_what_samples_cannot_show_is_refused(samples, complaint, words, capsys):
    from idbench.experiments.cli import main

    assert main(["identify", str(samples), "--robot", "puma560", "--torque", "instantaneous", *words]) == 2
    assert complaint in capsys.readouterr().err


def test_poses_and_samples_are_saved_with_their_report(samples, tmp_path, idbench):
    code, _, err = idbench("identify", samples, "--robot", "puma560", "--torque", "instantaneous", "--no-rerun", "--out", "x")
    assert code == 0, err
    assert (tmp_path / "x" / "report.html").is_file()


def test_friction_is_that_of_a_swing_that_nobody_drives_where_links_are_known(tmp_path):
    """A pendulum swings down, integrated here: m l^2 qdd = -m g l sin q - Fv qd - Fs sign(qd)."""
    (tmp_path / "pend.urdf").write_text(
        '<robot name="pend"><link name="base"/><joint name="swing" type="continuous"><parent link="base"/><child link="bob"/>'
        '<axis xyz="0 1 0"/></joint><link name="bob"><inertial><mass value="0.5"/><origin xyz="0 0 -0.3"/>'
        '<inertia ixx="0.002" iyy="0.002" izz="0.0005" ixy="0" ixz="0" iyz="0"/></inertial></link></robot>'
    )
    J, mgl, Fv, Fs, fs, steps = 0.002 + 0.5 * 0.09, 0.5 * 9.81 * 0.3, 0.004, 0.012, 200.0, 20
    q, qd, rows = 1.3, 0.0, []
    for k in range(int(12 * fs) * steps):
        if k % steps == 0:
            rows.append((k / steps / fs, q, 0.0))
        qd += (-mgl * np.sin(q) - Fv * qd - Fs * np.sign(qd)) / J / (fs * steps)
        q += qd / (fs * steps)
    log = tmp_path / "swing.csv"
    np.savetxt(log, rows, delimiter=",", header="t,q_swing,tau_swing", comments="", fmt="%.9g")
    robot = str(tmp_path / "pend.urdf")
    asked = IdentifyRequest(
        log=(log,), robot=robot, torque="instantaneous", parameters=Parameters("none", hold=("links=file",))
    )
    fit = identified(asked)
    explicit = fit.estimates["explicit"]
    assert dict(zip(explicit.names, explicit.X, strict=True)) == pytest.approx({"Fv1": Fv, "Fs1": Fs}, rel=0.02)
