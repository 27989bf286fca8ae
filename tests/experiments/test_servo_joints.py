"""The joints of an arm, one after the other, twice, and then their offsets; what is held of all, or of one."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from idbench.experiments.cli.options.jobs import IdentifyServo
from idbench.experiments.servo import joints as module
from idbench.experiments.servo import servo_text
from idbench.experiments.servo.identification import summary_of
from idbench.experiments.servo.job import held_of
from idbench.experiments.servo.joints import Joints, JointsLog
from idbench.experiments.servo.servo_text import mistake_words, value_of
from idbench.experiments.study.servo_rows import _joints
from idbench.identify import IdentificationError, LogError
from idbench.identify.files.layout import Asked
from idbench.identify.files.servo_log import ServoColumns, read_servo_log
from idbench.identify.servo import Servo, ServoFit, identify_again, identify_servo
from idbench.identify.servo.identification import APART, per_offset, with_friction
from idbench.identify.servo.mistakes import mistake_of
from idbench.identify.servo.search import Found
from idbench.identify.servo.stages import searched_runs
from idbench.sim.engine.simulation import simulate
from idbench.sim.robot.mounting import PLAIN
from idbench.sim.robot.servos import links
from idbench.sim.scenario.scenario_file import load

SERVO = Servo(0.166, 16.0, 12.0, 0.97, 4096)


@pytest.fixture
def arm():
    robot = links("servo_arm", PLAIN)
    t = np.arange(0, 2, 0.01)
    q = 0.3 * np.sin(np.outer(t, 1 + np.arange(robot.n)))
    columns = ServoColumns(t, q, q, None, None, robot.joints)
    return Joints(robot, (JointsLog("one.csv", columns, (SERVO,) * robot.n, robot),))


class Fake(SimpleNamespace):
    """Stands for a fit, which is known by its identity."""

    __hash__ = object.__hash__


def fit_of(joint):
    """Return what stands for a fit: it simulates the joint as it was measured, with a jolt that was not seen."""
    jolt = np.where(np.arange(200) == 100, 1e-3, 0.0)
    return Fake(
        name=joint, p={"Ia": 0.01}, taken_late=0.0,
        offset=0.0, scaled=False, explained=True, errors=lambda runs: np.zeros(1), of_all=None,
        fine=lambda run: (run.t, run.q + jolt), covariance=np.eye(1), free=("offset",), servo=SERVO,
    )  # fmt: skip


def test_a_joint_without_a_scale_moves_for_the_others_and_one_that_is_not_explained_does_not(arm, monkeypatch):
    seen, before = dict[str, float](), dict[str, float]()

    def identify(j, runs):
        before[j] = runs[0].load.rest
        assert runs[0].name == f"one.csv, {arm.links.joints[j]}"
        if j == 5:
            raise IdentificationError("does not move")
        return fit_of(j)

    def again(fit, runs):
        seen[fit.name] = runs[0].load.rest
        return fit

    monkeypatch.setattr(module, "identify_again", again)
    found = list(arm.identified(identify))
    assert [j for j, _ in found] == [0, 1, 2, 3, 4, 5, *(3 * [0, 1, 2, 3, 4])]
    assert found[5][1] == "does not move"
    assert sorted(seen) == [0, 1, 2, 3, 4]
    # The gripper, which nothing explains, moves as measured; only the jolt of the wrist roll reaches it.
    assert np.abs(seen[3] - before[3])[100] > 10 * np.abs(seen[3] - before[3])[:80].max()
    monkeypatch.setattr(module, "identify_again", lambda fit, runs: seen.update({fit.name: runs[0].load.rest}) or fit)
    alone = dict(seen)

    def without_roll(j, runs):
        if j >= 4:
            raise IdentificationError("does not move")
        return fit_of(j)

    list(arm.identified(without_roll))
    assert np.abs(seen[3] - alone[3]).max() > 0  # the roll no longer moves it


def test_a_joint_that_moves_alone_is_identified_once(arm):
    def identify(j, runs):
        if j:
            raise IdentificationError("does not move")
        return fit_of(j)

    assert len(list(arm.identified(identify))) == arm.links.n


CART = """
<mujoco><worldbody><body><joint name="rail" type="slide" axis="1 0 0"/><geom size="0.1" mass="1"/>
  <body><joint name="pole" axis="0 1 0"/><geom size="0.1" pos="0 0 -0.2" mass="0.2"/></body>
</body></worldbody></mujoco>
"""


def test_a_joint_that_slides_is_refused(tmp_path):
    (tmp_path / "cart.xml").write_text(CART)
    robot = links(str(tmp_path / "cart.xml"), PLAIN)
    t = np.arange(0, 2, 0.01)
    q = np.zeros((len(t), robot.n)) + 0.1 * np.sin(t)[:, None]
    log = JointsLog("one.csv", ServoColumns(t, q, q, None, None, robot.joints), (SERVO,) * robot.n, robot)
    found = dict(Joints(robot, (log,)).identified(lambda j, runs: fit_of(j)))
    assert "rail slides" in found[0]
    assert not isinstance(found[1], str)


@pytest.mark.thorough
def test_offsets_are_what_gravity_says_of_all_joints_and_their_changes_what_another_fit_finds():
    """Of a simulated arm whose encoders have their zeros where its file has them."""
    scenario = load("servo-arm")
    scenario = replace(scenario, trajectory=replace(scenario.trajectory, steps=36), seed=4)
    joints = _joints(scenario, simulate(scenario).alone())
    found = {
        j: fit for j, fit in joints.identified(lambda j, runs: identify_servo(runs, "coulomb")) if not isinstance(fit, str)
    }
    assert {1, 2} <= set(found)
    for j in (1, 2):
        sigma = found[j].standard_errors["offset"]
        assert abs(found[j].p["offset"]) < 3 * sigma < 0.05
    shoulder, elbow = found[1], found[2]
    alone = {k: fit for k, fit in found.items() if k != 1}
    place = elbow.free.index("offset")
    for apart in (0.0, 0.03):
        other = replace(shoulder, found=replace(shoulder.found, p={**shoulder.p, "offset": apart}))
        runs = joints.runs_with({**alone, 1: other})
        again = identify_again(elbow, runs[2])
        if not apart:
            one = again
    now = joints.runs_with({**alone, 1: replace(shoulder, found=replace(shoulder.found, p={**shoulder.p, "offset": 0.0}))})
    shifted = joints.runs_with(
        {**alone, 1: replace(shoulder, found=replace(shoulder.found, p={**shoulder.p, "offset": APART}))}
    )
    slope = per_offset(one, *(searched_runs(x, elbow.p["delay"]) for x in (now[2], shifted[2])))[place]
    assert again.p["offset"] - one.p["offset"] == pytest.approx(0.03 * slope, rel=0.2)


def test_a_joint_has_what_is_held_for_it_before_what_is_held_for_all():
    held = held_of(IdentifyServo(hold=("wrist.roll.a=0.7", "a=0.5", "Ia=0.02")), ["elbow", "wrist.roll"])
    assert held == {"elbow": {"a": 0.5, "Ia": 0.02}, "wrist.roll": {"a": 0.7, "Ia": 0.02}}


@pytest.mark.thorough
def test_a_joint_whose_load_sets_no_scale_has_neither_gain_nor_offset():
    """The gripper, which nearly nothing pulls: 2.97 times the true gain fitted better (p = 8e-6), and an offset of 0.4 rad."""
    scenario = load("servo-arm")
    joints = _joints(scenario, simulate(scenario).alone())
    fit = dict(joints.identified(lambda j, runs: identify_servo(runs, "coulomb")))[5]
    assert not fit.scaled
    assert fit.p["offset"] != 0 == fit.offset
    assert summary_of(fit)["offset"]["value"] is None
    assert value_of(fit, "offset") == "no scale"
    assert mistake_of(fit) is None


def test_a_commanded_velocity_is_a_torque_of_kd_beside_the_angle(tmp_path):
    """As of loops in MIT mode, kp (u - q) + kd (v - qd) + tau; two sets of commands that are not told apart are asked for."""
    t = np.arange(0, 1, 0.01)
    q, v, tau = 0.2 * np.sin(5 * t), np.cos(5 * t), 0.1 * t
    table = np.c_[t, q, q, v, tau]
    np.savetxt(tmp_path / "a.csv", table, "%.9g", ",", header="t,q1,command1,qd_des1,forward1", comments="")
    columns, _ = read_servo_log(tmp_path / "a.csv")
    robot, loop = links("pendulum", PLAIN), Servo(kp=25.0, kd=0.6, kind="torque")
    ((run,),) = Joints(robot, (JointsLog("a.csv", columns, (loop,), robot),)).runs
    np.testing.assert_allclose(run.forward, tau + 0.6 * v, atol=1e-8)
    np.savetxt(tmp_path / "b.csv", table, "%.9g", ",", header="t,q1,command_q1,command_v1,forward1", comments="")
    with pytest.raises(LogError, match=r"1 columns of positions and 2 of commands.*velocity=NAME"):
        read_servo_log(tmp_path / "b.csv")
    asked = Asked(None, {"command": ("command_q1",), "velocity": ("command_v1",)}, {"velocity": "rad/s"}, {})
    np.testing.assert_allclose(read_servo_log(tmp_path / "b.csv", asked)[0].velocity[:, 0], v, atol=1e-8)


def test_a_wrong_kd_is_called_kd():
    mistake = SimpleNamespace(cause="lead", size=(-0.0557,), p=1e-9, alternatives=(), held_out=(0.06, 0.0005))
    fit = SimpleNamespace(servo=Servo(kp=25.0, kd=3.0, kind="torque"))
    assert mistake_words(mistake, fit).startswith("kd is 1.4 N m s/rad too large (p = 1e-09); with --find lead")


def fitted(moved):
    """Return what stands for a fit of a joint that moved by so much in the fitted log, without a mistake [rad]."""
    return SimpleNamespace(loop=SimpleNamespace(step=0.0), explained=True, excitation=SimpleNamespace(range=moved), free=())


@pytest.mark.parametrize(("moved", "joint", "word"), [(0.4, "b", "good"), (1e-4, "a", "poor")])
def test_the_first_line_is_on_the_worst_joint_that_moved(monkeypatch, moved, joint, word):
    """Joint a rests in the held-out log: errors in per cent of nothing; where all rest, one of them is there all the same."""
    monkeypatch.setattr(servo_text, "_lacks", lambda _: "its residuals are small")
    fits, off = {"a": fitted(1.0), "b": fitted(1.0)}, np.array([1e-3])
    lines = servo_text.verdict_lines(fits, {"a": off, "b": off}, {"a": off, "b": off}, {"a": 1e-5, "b": moved}, {})
    assert lines[0][0] == word
    assert lines[0][1].startswith(f"Result: {word} ({joint}): positions off by")


def test_friction_that_is_held_is_not_fitted_again():
    p = {"Fs": 0.1, "Fv": 0.2, "Ia": 0.01, "offset": 0.0, "Fl": 0.5}
    found = Found(p, 0.0, np.empty(0), np.empty(0), np.empty(0), None)
    loop = SimpleNamespace(runs=[SimpleNamespace(load=SimpleNamespace(torque=lambda *_: np.ones(3)), t=None, clean=None)])
    fit = ServoFit("load", ("Ia",), found, loop, None, (1.0, 1.0))
    again = with_friction(fit, "coulomb")
    assert again.p == {"Fs": 0.6, "Fv": 0.2, "Ia": 0.01, "offset": 0.0}
    assert (again.friction, again.free) == ("coulomb", ())
