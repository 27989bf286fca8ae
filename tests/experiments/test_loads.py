"""Payloads and gains of drives, of a simulated arm whose truth is known, and what the commands say."""

import re
from dataclasses import replace

import numpy as np
import pytest
from pairs import Pairs

from idbench.experiments.errors import ExperimentError, ResultsError
from idbench.experiments.loads.job import payload_of
from idbench.experiments.requests.jobs import KnownOptions, PayloadRequest
from idbench.experiments.requests.shared import ColumnOptions
from idbench.identify import ESTIMATORS, LogError, MotionLog, SettingError
from idbench.identify.files.log_file import write_log
from idbench.identify.loads.drive_gains import identify_drive_gains
from idbench.identify.loads.payload import WAYS, with_known_robot
from idbench.sim.robot.robot import Robot
from idbench.sim.scenario.scenario_file import from_dict

LOAD = {"mass": 2.0, "position": [0.03, -0.02, 0.15], "inertia": 0.012}


@pytest.fixture(scope="session")
def pairs():
    """Return a pair of short runs of the PUMA with and without a payload."""
    content = {
        "name": "loaded",
        "robot": "puma560",
        "fs": 200.0,
        "trajectory": {"kind": "random", "moves": 10, "durations": [1.0, 1.0], "velocity": 2.0, "rest": 1.0},
        "controller": {"kind": "computed_torque", "bandwidth": 20.0},
        "encoder": {"kind": "incremental", "lines": 32768},
        "torque": {"noise": 0.05},
        "physics": {"step": 0.0025},
        "payload": LOAD,
    }
    return Pairs(from_dict(content))


def short(pairs):
    """Return the scenario with fewer moves."""
    return replace(pairs.scenario, trajectory=replace(pairs.scenario.trajectory, moves=7))


@pytest.fixture
def robot(pairs):
    return replace(pairs.robot(0, {}), estimator=ESTIMATORS.create("WLS"))


@pytest.mark.thorough
@pytest.mark.parametrize(("way", "sigmas"), [("together", 4.0), ("fixed", 4.0)])
def test_a_payload_is_found(robot, pairs, way, sigmas):
    found = WAYS[way](robot)
    assert found.complete
    values, truth = dict(zip(found.names, found.X, strict=True)), pairs.truth
    assert values["ML"] == pytest.approx(2.0, rel=0.01)
    for name in ("MXL", "MYL", "MZL"):
        assert values[name] == pytest.approx(truth[name], abs=0.02 * 0.3)
    z = (found.X - [truth[name] for name in found.names]) / found.sigma
    assert np.abs(z).max() < sigmas  # of ten, 4 sigma is one in 1600


def test_the_body_can_exist(robot):
    body = WAYS["together"](robot).consistent()
    centre = body[6:9] / body[9]
    np.testing.assert_allclose(centre, LOAD["position"], atol=2e-3)
    inertia = np.array([[body[0], body[1], body[2]], [body[1], body[3], body[4]], [body[2], body[4], body[5]]])
    about = inertia - body[9] * (centre @ centre * np.eye(3) - np.outer(centre, centre))
    assert np.linalg.eigvalsh(about)[0] > 0


def test_a_robot_known_beforehand_gives_what_fixed_gives(robot):
    first = robot.estimated(robot.without, robot.robot.basis)
    found = with_known_robot(replace(robot, without=()), first.names, first.X, first.covariance)
    np.testing.assert_allclose(found.X, WAYS["fixed"](robot).X, rtol=1e-9)
    exact = with_known_robot(replace(robot, without=()), first.names, first.X, 0 * first.covariance)
    assert (exact.sigma <= found.sigma).all()  # what is open of the robot is open of the payload


def test_what_is_known_of_a_payload_stays(robot):
    found = WAYS["together"](replace(robot, known={"ML": 2.0}))
    assert "ML" not in found.names
    assert found.standard()[-1] == 2.0
    assert found.consistent()[-1] == pytest.approx(2.0, rel=1e-3)
    with pytest.raises(SettingError, match="a payload has no parameter M7"):
        replace(robot, known={"M7": 2.0})


@pytest.mark.thorough
@pytest.mark.parametrize("all_known", [False, True])
def test_gains_are_found(pairs, all_known):
    gains = np.array([0.8, 1.3, 1.1, 0.75, 1.25, 0.9])
    known = pairs.truth if all_known else {"ML": 2.0}
    robot = replace(pairs.robot(0, known, gains), estimator=ESTIMATORS.create("WLS"))
    found = identify_drive_gains(robot)
    assert found.shown.all()
    np.testing.assert_allclose(found.gains, gains, rtol=0.02)
    assert np.abs((found.gains - gains) / found.sigma).max() < 4.0


@pytest.mark.thorough
def test_least_squares_of_currents_finds_gains_too_small(pairs):
    """Noise of the currents on the side of the parameters: the classical fault, which the way taken here does not have."""
    noisy = replace(short(pairs), torque=replace(pairs.scenario.torque, noise=(2.0,)))
    pair = Pairs(noisy)
    robot = replace(pair.robot(0, {"ML": 2.0}), estimator=ESTIMATORS.create("WLS"))
    ours = identify_drive_gains(robot)
    rows = robot.estimated(robot.of_both, robot.both.basis).problem.rows
    mass = rows.names.index("ML")
    currents = np.zeros((len(rows.Y), 6))
    currents[np.arange(len(rows.Y)), rows.group] = rows.Y
    A = np.concatenate([currents, -np.delete(rows.W, mass, axis=1)], axis=1)
    scale = np.linalg.norm(A, axis=0)
    theirs = (np.linalg.lstsq(A / scale, 2.0 * rows.W[:, mass], rcond=None)[0] / scale)[:6]
    assert (np.abs(ours.gains - 1) < 4 * ours.sigma).all()
    assert (theirs[3:] < 0.9).all()  # wrists, whose torques are small


@pytest.mark.thorough
def test_a_payload_on_the_axis_says_nothing_of_its_gain(pairs):
    """The last joint of a payload whose mass alone counts, on its axis, is refused; the others are not."""
    on_axis = replace(short(pairs), payload=replace(pairs.scenario.payload, position=(0.0, 0.0, 0.15), inertia=0.0))
    pair = Pairs(on_axis)
    gains = np.array([0.8, 1.3, 1.1, 0.75, 1.25, 0.9])
    robot = replace(pair.robot(0, {"ML": 2.0}, gains), estimator=ESTIMATORS.create("WLS"))
    found = identify_drive_gains(robot)
    assert found.shown[:5].all()
    assert not found.shown[5]


def test_gains_need_what_is_known(pairs):
    with pytest.raises(SettingError, match="nothing is known of the payload"):
        identify_drive_gains(pairs.robot(0, {}))
    with pytest.raises(SettingError, match="there is no log without the payload"):
        identify_drive_gains(replace(pairs.robot(0, {"ML": 2.0}), without=()))
    with pytest.raises(LogError, match="there is no log with the payload"):
        replace(pairs.robot(0, {}), loaded=())


@pytest.fixture
def files(pairs, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for name, log in zip(("empty.parquet", "full.parquet"), (run.alone(0) for run in pairs.simulated), strict=True):
        write_log(MotionLog(log.fs, log.q, log.tau, log.torque), tmp_path / name)
    return tmp_path


PAIR = "full.parquet --unloaded empty.parquet --robot puma560 --estimator WLS --out found"


def test_the_payload_command(files, ran):
    out, _, summary = ran("payload", PAIR, "--write arm.xml")
    mass = re.search(r"the nearest physically consistent body: ([\d.]+) kg", out)
    assert float(mass[1]) == pytest.approx(2.0, rel=0.01)
    robot = Robot.load(str(files / "arm.xml"))
    assert robot.model.body("payload").mass[0] == pytest.approx(2.0, rel=0.01)
    assert summary["body"]["mass"] == pytest.approx(2.0, rel=0.01)
    assert len(summary["ways"]["together"]["covariance"]) == 10
    report = (files / "found" / "report.html").read_text()
    assert "Result: " in report
    assert "payload, about the origin of the frame of joint6" in report


def test_a_payload_is_shown_though_it_cannot_be_saved(files, idbench, monkeypatch):
    def full(*_):
        raise ResultsError("cannot write to found: No space left on device")

    monkeypatch.setattr("idbench.experiments.cli.commands.loads.save_summary", full)
    code, out, err = idbench("payload", *PAIR.split())
    assert code == 2
    assert "payload, about the origin of the frame of joint6" in out
    assert "No space left on device" in err


@pytest.mark.thorough
def test_the_payload_of_a_robot_identified_before(files, ran):
    ran("identify empty.parquet --robot puma560 --model explicit --estimator WLS --write arm.json")
    found = ran("payload full.parquet --before arm.json --robot puma560 --out found").summary
    assert found["body"]["mass"] == pytest.approx(2.0, rel=0.01)


@pytest.mark.thorough
def test_the_gains_command(files, ran):
    out, _, summary = ran("gains", PAIR, "--mass 2.0")
    assert "gains of the drives" in (files / "found" / "report.html").read_text()
    assert re.search(r"^next: --gain [\d. ]+ reads logs with these gains$", out, re.MULTILINE)
    np.testing.assert_allclose(summary["gains"], 1.0, rtol=0.02)


def asked_of(files, **more):
    return PayloadRequest(
        log=(files / "full.parquet",), unloaded=(files / "empty.parquet",), robot="puma560", estimator="WLS", **more
    )


@pytest.mark.thorough
def test_what_is_open_of_the_gains_is_open_of_the_payload(files):
    """All gains scale all parameters: the slopes by each add up to the payload, so that sigmas s of n gains make s ML / sqrt(n)
    of its mass at least, and s ML at most times the root of the sum of squared weights."""
    s, plain = 0.03, payload_of(asked_of(files)).leading
    found = payload_of(asked_of(files, gain_sigma=(s,))).leading
    np.testing.assert_allclose(found.X, plain.X)
    mass = found.names.index("ML")
    own, more = plain.covariance[mass, mass], found.covariance[mass, mass]
    assert more - own > (s * found.X[mass]) ** 2 / 6
    one = payload_of(asked_of(files, gain_sigma=(0.0, s, 0.0, 0.0, 0.0, 0.0))).leading
    assert own <= one.covariance[mass, mass] < more
    with pytest.raises(ExperimentError, match="--gain-sigma 2: give a share"):
        payload_of(asked_of(files, gain_sigma=(2.0,)))


@pytest.mark.thorough
def test_a_wrong_gain_of_both_logs_is_no_good_payload_and_is_named(files):
    """Torques of joint 3 a tenth too large: other verdicts are those of one robot with one payload, which stays fair."""
    right = payload_of(asked_of(files))
    assert right.judgement.word(right.judgement.warnings(right.leading)) == "good"
    made = payload_of(asked_of(files, reading=ColumnOptions(gain=(1.0, 1.0, 1.1, 1.0, 1.0, 1.0))))
    judgement = made.judgement
    assert (judgement.causes[0].suspect.cause, judgement.causes[0].joint) == ("gain", judgement.robot.tree.joints[2].name)
    assert judgement.causes[0].suspect.size[0] == pytest.approx(0.1, abs=0.01)
    assert judgement.word(judgement.warnings(made.leading)) != "good"


@pytest.mark.thorough
def test_a_torque_with_the_other_sign_is_named_in_both_logs(files):
    gain = (1.0, 1.0, -1.0, 1.0, 1.0, 1.0)
    causes = payload_of(asked_of(files, reading=ColumnOptions(gain=gain))).judgement.causes
    assert [(c.suspect.cause, c.suspect.of, c.suspect.joint) for c in causes[:1]] == [("sign", "torque", 2)]
    assert causes[0].remedy == "--gain 1 1 1 1 1 1"  # the signs of those that it was read with


@pytest.mark.thorough
def test_the_command_that_shows_the_gains_is_said_in_full(files):
    note = payload_of(asked_of(files)).lines[-1]
    command = note.partition("a payload of known mass shows them: ")[2]
    assert command.startswith("uv run idbench gains ")
    assert command.endswith("--robot puma560 --mass KG --at X Y Z")
    known = payload_of(asked_of(files, known=KnownOptions(mass=3.0)))
    assert any("--mass 3 --at X Y Z" in warning for warning in known.judgement.warnings(known.leading)["the payload"])


def test_the_delay_is_that_of_the_logs_without_the_payload(files):
    """Together they would be of one robot, which they are not: the delay would explain the payload."""
    stated = payload_of(asked_of(files, torque="held", torque_delay="0"))
    made = payload_of(asked_of(files, torque="held", torque_delay="estimate"))
    alone, both = (one.judgement.robot for one in (stated, made))
    found = {log.torque.delay for log in (*both.without, *both.loaded)}
    assert len(found) == 1
    assert abs(found.pop() - alone.without[0].torque.delay) < 1e-4  # a fiftieth of a sample; of both logs it was milliseconds
    mass = made.leading.names.index("ML")
    assert made.leading.sigma[mass] < 1.1 * stated.leading.sigma[mass]  # the delay is known far better than the mass needs
