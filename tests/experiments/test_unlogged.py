"""What a log does not hold: torques of a joint, positions, motion. The rest is fitted, and what is missing is named."""

from dataclasses import replace

import numpy as np
import pytest

from idbench.experiments.exports.exports import origin
from idbench.experiments.identification.job import identified
from idbench.experiments.judgement.judgement import conclusion, judge
from idbench.experiments.requests.jobs import IdentifyRequest
from idbench.identify import LogError, MotionLog, TorqueChannel
from idbench.identify.files.log_file import CSV, read_log, write_log
from idbench.identify.files.reading import read_columns
from idbench.sim.engine.run import ideal_log
from idbench.sim.robot.inverse_dynamics import coulomb_torque, inverse_dynamics
from idbench.sim.robot.robot import Robot
from idbench.sim.trajectories import RandomMoves, Reference

LAST = 5
"""Joint of the PUMA whose torque is missing."""


def table(path):
    """Return the names and the values of a log."""
    return path.read_text().partition("\n")[0].strip().replace('"', "").split(","), np.genfromtxt(
        path, delimiter=",", skip_header=1
    )


def saved(path, names, values):
    np.savetxt(path, values, delimiter=",", header=",".join(names), comments="", fmt="%.10g")
    return path


@pytest.fixture(scope="module")
def csv(logs):
    """A log of the PUMA as text, with the noise of its drives."""
    write_log(read_log(logs / "first.parquet", joints=Robot.load("puma560").joints), logs / "first.csv")
    return logs / f"first{CSV}"


MANY = [pytest.param(word, marks=pytest.mark.thorough) for word in ("nan", "zero")]


@pytest.fixture(scope="module", params=["absent", *MANY])
def without(request, csv, tmp_path_factory):
    """The log without the torque of the last joint."""
    names, values = table(csv)
    own = next(k for k, name in enumerate(names) if name.startswith("tau") and name.endswith(str(LAST + 1)))
    folder = tmp_path_factory.mktemp("without")
    if request.param == "absent":
        kept = [k for k in range(len(names)) if k != own]
        return saved(folder / "log.csv", [names[k] for k in kept], values[:, kept])
    values[:, own] = np.nan if request.param == "nan" else 0.0
    return saved(folder / "log.csv", names, values)


def asked(path, **more):
    return IdentifyRequest(log=(path,), robot="puma560", torque="held", torque_delay="0.00065915", **more)


def test_rows_without_a_torque_are_left_out_and_the_others_fitted(without, csv):
    """As well as with all torques: no parameter of the first joints moves by more than its own sigma, where all rows
    would give 0.6 on average."""
    fit, whole = identified(asked(without)), identified(asked(csv))
    assert fit.logs.fitted[0].missing == (LAST,)
    one, other = fit.estimates["explicit"], whole.estimates["explicit"]
    shared = [name for name in one.names if name[-1] in "123"]
    places = [[e.names.index(name) for name in shared] for e in (one, other)]
    off = np.abs(one.X[places[0]] - other.X[places[1]]) / one.standard_errors[places[0]]
    assert off.max() < 4
    assert np.mean(off**2) < 1
    assert set(fit.hidden) >= {f"Fv{LAST + 1}", f"Fs{LAST + 1}"}
    assert "power" not in fit.estimates
    assert "was not logged" in fit.failures["power"]


def test_what_was_not_logged_is_not_judged_and_does_not_decide(without):
    made = judge(identified(asked(without)))
    one = made.held_out[0]
    assert np.isnan(one.torques["explicit"].percent[LAST])
    assert np.isfinite(np.delete(one.torques["explicit"].percent, LAST)).all()
    assert "was not logged" in one.verdicts["explicit"].unsimulated
    causes = [cause.suspect.cause for cause in made.fit.diagnosis or ()]
    zeros = "tau6" in table(without)[0] and not np.isnan(table(without)[1]).any()
    assert causes == ["missing_torque"] * zeros  # what a file says itself is no mistake
    assert (one.verdicts["explicit"].word == "good") != zeros
    if zeros:
        before, after = made.fit.diagnosis[0].suspect.held_out
        assert after < before


@pytest.mark.thorough
@pytest.mark.parametrize("estimator", ["ML", "OE", "UKF"])
def test_estimators_that_need_all_torques_say_so(csv, complaint, tmp_path, estimator):
    names, values = table(csv)
    path = saved(tmp_path / "log.csv", names[:-1], values[:, :-1])
    words = ["identify", str(path), "--robot", "puma560", "--torque", "held", "--torque-delay", "0.002"]
    said = complaint(*words, "--estimator", estimator, "--model", "explicit")
    assert "the torque of joint 6 was not logged" in said
    assert "GLS" in said


def test_a_column_that_could_be_the_missing_torque_is_not_passed_over(csv, tmp_path):
    names, values = table(csv)
    path = saved(tmp_path / "log.csv", [*names[:-1], "torque_6"], values)
    with pytest.raises(LogError, match="are they torque_6"):
        read_columns(path)


def test_no_torque_at_all_is_refused(csv, tmp_path):
    names, values = table(csv)
    values[:, [name.startswith("tau") for name in names]] = np.nan
    with pytest.raises(LogError, match="no torque of it has a value"):
        read_columns(saved(tmp_path / "log.csv", names, values))


MOTOR = """<robot name="m"><link name="base"/><link name="rotor"><inertial><mass value="0.1"/>
<inertia ixx="1e-5" iyy="1e-5" izz="1e-5" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="shaft" type="continuous"><parent link="base"/><child link="rotor"/><axis xyz="0 0 1"/></joint></robot>"""


@pytest.mark.thorough
def test_velocities_and_torques_of_a_motor_on_a_bench_give_inertia_and_friction(tmp_path):
    """Fv, Fs and rotor of a known law, with the noise of a current; no position was logged."""
    rng, t = np.random.default_rng(0), np.arange(4000) / 200
    Ia, Fv, Fs = 8e-4, 0.02, 0.11
    qd = 4 * np.sin(2 * np.pi * 0.35 * t) + 3 * np.sin(2 * np.pi * 1.1 * t + 1)
    qdd = 2 * np.pi * (4 * 0.35 * np.cos(2 * np.pi * 0.35 * t) + 3 * 1.1 * np.cos(2 * np.pi * 1.1 * t + 1))
    tau = Ia * qdd + Fv * qd + Fs * np.sign(qd) + 0.003 * rng.standard_normal(len(t))
    noisy = qd + 0.002 * rng.standard_normal(len(t))
    path = saved(tmp_path / "motor.csv", ["t", "qd1", "tau1"], np.column_stack([t, noisy, tau]))
    (tmp_path / "motor.urdf").write_text(MOTOR)
    request = IdentifyRequest(log=(path,), robot=str(tmp_path / "motor.urdf"), torque="instantaneous", model="explicit")
    fit = identified(request)
    assert any("velocities are integrated" in note for note in fit.logs.notes)
    found = fit.estimates["explicit"]
    assert found.names == ("ZZR1", "Fv1", "Fs1")
    z = (found.X - [Ia, Fv, Fs]) / found.standard_errors
    assert np.abs(z).max() < 4
    assert (found.standard_errors < 0.02 * np.array([Ia, Fv, Fs])).all()


def poses(count, seed):
    """Return poses of the PUMA at rest, and the torques of gravity, by MuJoCo."""
    robot, rng = Robot.load("puma560"), np.random.default_rng(seed)
    q = rng.uniform(*np.clip(robot.ranges, -2, 2).T, (count, robot.n))
    none = np.zeros_like(q)
    return q, inverse_dynamics(robot, q, none, none)


@pytest.fixture
def rest(tmp_path):
    """Write poses a second apart, with torques' noise [N m]."""

    def write(name, count, seed, noise):
        q, tau = poses(count, seed)
        tau = tau + noise * np.random.default_rng(seed + 1).standard_normal(tau.shape)
        names = ["t", *(f"q{j + 1}" for j in range(6)), *(f"tau{j + 1}" for j in range(6))]
        return saved(tmp_path / name, names, np.column_stack([np.arange(count), q, tau]))

    return write


def test_poses_at_rest_give_gravity_and_their_standard_errors_hold(rest):
    """The gravity parameters of the file, from 60 poses with noise of 0.05 N m; nothing is differentiated."""
    z = []
    for seed in range(6):
        path = rest(f"{seed}.csv", 60, 10 * seed, 0.05)
        fit = identified(IdentifyRequest(log=(path,), robot="puma560", torque="instantaneous"))
        assert fit.request.method.chain_name == "poses"
        estimate, truth = fit.estimates["explicit"], fit.robot_model.truth(fit.robot_model.robot)
        assert all(name.startswith("M") for name in estimate.names)
        z += [(x - truth[name]) / s for name, x, s in zip(estimate.names, estimate.X, estimate.standard_errors, strict=True)]
    assert len(z) > 30
    assert 0.6 < np.mean(np.square(z)) < 1.6  # chi2 over its degrees of freedom, 5 sigma of it


def test_poses_are_judged_without_the_joint_that_carries_nothing(rest):
    fit = identified(IdentifyRequest(log=(rest("a.csv", 80, 0, 0.02),), robot="puma560", torque="instantaneous"))
    made = judge(fit)
    verdict = made.held_out[0].verdicts["explicit"]
    assert np.isnan(verdict.validation.percent[0])  # an upright axis
    assert verdict.word in ("good", "unsure")
    assert not fit.diagnosis
    assert "poses at rest" in verdict.unsimulated


def test_rows_that_continue_each_other_are_no_poses_unless_that_is_stated(csv, tmp_path, complaint):
    """Times in ms, which would be a second apart."""
    names, values = table(csv)
    values[:, 0] *= 1e3
    path = saved(tmp_path / "ms.csv", names, values)
    words = ["identify", str(path), "--robot", "puma560", "--torque", "held"]
    assert "--units t=ms" in complaint(*words)


@pytest.mark.parametrize(
    ("more", "said"),
    [
        (("--torque-delay", "estimate"), "show no delay"),
        (("--cutoff", "3"), "no band"),
        (("--chain", "paper"), "no band"),
        (("--estimator", "ML"), "poses at rest hold no motion"),
        (("--model", "power"), "poses at rest have no power"),
    ],
)
def test_options_that_poses_cannot_meet_are_refused(rest, complaint, more, said):
    path = rest("a.csv", 40, 0, 0.02)
    assert said in complaint("identify", str(path), "--robot", "puma560", "--torque", "instantaneous", *more)


def test_motion_is_no_held_out_log_of_poses(rest, csv, complaint):
    path = rest("a.csv", 40, 0, 0.02)
    words = ["identify", str(path), "--robot", "puma560", "--torque", "instantaneous", "--validate", str(csv)]
    assert "is of motion, what is identified of poses at rest" in complaint(*words)


@pytest.mark.thorough
def test_a_joint_is_unknown_only_if_no_fitted_log_has_its_torque(without, csv, logs):
    """Two logs are fitted, one lacks the torque of the last joint: the held-out log is judged for it nevertheless."""
    fit = identified(replace(asked(without), log=(without, csv), validate=(logs / "second.parquet",)))
    assert [log.missing for log in fit.logs.fitted] == [(LAST,), ()]
    (found,) = judge(fit).held_out
    assert found.log.missing == ()


def test_a_log_without_torques_of_a_joint_stays_so_in_every_piece():
    q = np.random.default_rng(0).standard_normal((50, 3))
    log = MotionLog(100.0, q, q, TorqueChannel("held"), missing=(1,))
    assert log.part(3, 9).missing == replace(log, fs=50.0).missing == (1,)


@pytest.mark.thorough
def test_a_log_of_ten_hertz_gets_a_band_of_its_own(tmp_path):
    """Sines up to 0.35 Hz, by MuJoCo's inverse dynamics: the usual band of 5 Hz would be all that 10 Hz hold."""
    robot, rng, t = Robot.load("puma560"), np.random.default_rng(3), np.arange(900) / 10
    w = 2 * np.pi * np.array([0.05, 0.11, 0.19, 0.27, 0.35])[:, None, None]
    a, phase = rng.uniform(0.1, 0.3, (5, robot.n, 1)), rng.uniform(0, 6, (5, robot.n, 1))
    q, qd, qdd = (np.sum(a * w**k * np.sin(w * t + phase + k * np.pi / 2), axis=0).T for k in range(3))
    tau = inverse_dynamics(robot, q, qd, qdd) + coulomb_torque(robot, qd)
    tau += 0.01 * np.std(tau, axis=0) * rng.standard_normal(tau.shape)
    names = ["t", *(f"q{j + 1}" for j in range(6)), *(f"tau{j + 1}" for j in range(6))]
    path = saved(tmp_path / "slow.csv", names, np.column_stack([t, q, tau]))
    fit = identified(IdentifyRequest(log=(path,), robot="puma560", torque="instantaneous", model="explicit"))
    assert any("since the log is sampled slowly" in note for note in fit.logs.notes)
    assert judge(fit).held_out[0].verdicts["explicit"].word == "good"
    found, truth = fit.estimates["explicit"], fit.robot_model.truth(fit.robot_model.robot)
    z = (found.X - [truth[name] for name in found.names]) / found.standard_errors
    assert np.mean(np.abs(z) < 2) > 0.8  # 95 % expected, of some 36 that are correlated


def test_joints_that_never_moved_are_named_in_the_verdict_and_in_files(tmp_path):
    robot, rng = Robot.load("puma560"), np.random.default_rng(3)
    moves = RandomMoves(moves=10, durations=(0.8, 1.2), velocity=(2.0,), rest=0.2).sample(robot, 200.0)
    moving = np.arange(robot.n) < 3
    q, qd, qdd = (np.where(moving, x, still) for x, still in ((moves.q, 0.1), (moves.qd, 0.0), (moves.qdd, 0.0)))
    log = ideal_log(robot, Reference(200.0, q, qd, qdd))
    write_log(replace(log, tau=log.tau + 0.05 * rng.normal(size=log.tau.shape)), tmp_path / "half.parquet")
    fit = identified(IdentifyRequest(log=(tmp_path / "half.parquet",), robot="puma560", model="explicit"))
    assert fit.still == ["joint4", "joint5", "joint6"]
    assert "NOTHING IS KNOWN of joint4, joint5, joint6, which never moved" in origin(fit, "explicit")
    assert "nothing is known of joint4, joint5, joint6: no motion" in conclusion(judge(fit), {}).why
