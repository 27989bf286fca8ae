"""The virtual servo: its firmware, its winding, and free play in its gear."""

from dataclasses import replace

import numpy as np
import pytest

from idbench.identify.files.log_file import write_log
from idbench.identify.files.servo_log import read_servo_log
from idbench.identify.servo import JointLoad, Servo, ServoRun
from idbench.identify.servo.closed_loop import ServoLoop
from idbench.sim.drives import ServoDrive
from idbench.sim.encoders import ExactEncoder
from idbench.sim.engine.simulation import simulate
from idbench.sim.engine.watch import Watch
from idbench.sim.errors import RobotError, ScenarioError
from idbench.sim.robot.robot import Robot
from idbench.sim.scenario.scenario_file import from_dict, load, to_dict

H = 5e-4
K, R, V = 2.05, 3.33, 12.0
BENCH = load("servo")
LAW = {
    "a": K / R,
    "b": K**2 / R,
    "Ia": BENCH.drive.armature[0],
    "Fs": BENCH.friction.coulomb[0],
    "Fv": BENCH.friction.viscous[0],
}
LAW |= {"offset": 0.0, "delay": BENCH.timing.delay, "rate": BENCH.drive.rate}


def torque(command, q, qd, steps=1, **settings):
    """Return the torque of one servo in its last of some steps, that begin at rest at q = 0."""
    servo = ServoDrive(**settings).start(Robot.load("pendulum"), 1, H)
    servo.sees(np.zeros((1, 1, 1)))
    servo.step(np.zeros((1, 1)), np.zeros((1, 1, 1)), 1)
    servo.sees(np.full((1, 1, 1), q))
    return float(servo.step(np.full((1, 1), command), np.full((1, 1, 1), qd), steps)[-1, 0, 0])


@pytest.mark.parametrize(
    ("settings", "q", "qd", "expected"),
    [
        ({"rate": None, "counts": 0}, 0.4, 0.0, K / R * V * 0.166 * 16 * 0.1),
        ({"rate": None, "counts": 0}, 0.4, 1.5, K / R * (V * 0.166 * 16 * 0.1 - K * 1.5)),
        ({"rate": None, "counts": 0, "lead": 0.01}, 0.4, 1.5, K / R * (V * 0.166 * 16 * (0.1 - 0.015) - K * 1.5)),
        ({"rate": None, "counts": 0, "dead_band": 0.03}, 0.4, 0.0, K / R * V * 0.166 * 16 * 0.07),
        ({"rate": None}, -1.0, 0.0, K / R * V * 0.97),
        ({"rate": None, "current_limit": 1.5}, -1.0, 0.0, K * 1.5),
        ({"rate": None, "off": ((0.0, 1.0),)}, -1.0, 2.0, 0.0),
        ({"rate": None, "off": ((0.0, 1.0),), "winding": "shorted"}, -1.0, 2.0, -(K**2) / R * 2.0),
    ],
    ids=["P", "back-EMF", "PD", "dead band", "duty limit", "current limit", "open", "shorted"],
)
def test_the_torque_is_that_of_the_law(settings, q, qd, expected):
    assert torque(0.5, q, qd, **settings) == pytest.approx(expected, rel=1e-12)


def test_the_firmware_sees_counts():
    count = 2 * np.pi / 4096
    seen = [torque(0.5, 0.4 + x * count, 0.0, rate=None) for x in (0.0, 0.2, 1.2)]
    assert seen[0] == seen[1]
    assert seen[0] - seen[2] == pytest.approx(K / R * V * 0.166 * 16 * count, rel=1e-9)


def targets(rate, acceleration, h, steps):
    """Mean targets of steps after a command of 1 rad, from the torques of a servo that nothing limits."""
    settings = {"rate": rate, "acceleration": acceleration, "counts": 0, "supply": 1e6, "kp": 1e-3, "gain": 1e-3}
    servo = ServoDrive(**settings).start(Robot.load("pendulum"), 1, h)
    servo.step(np.zeros((1, 1)), np.zeros((1, 1, 1)), 1)
    return servo.step(np.ones((1, 1)), np.zeros((1, 1, 1)), steps)[:, 0, 0] / (K / R)


def test_a_target_keeps_its_rate():
    np.testing.assert_allclose(targets(2.0, None, 0.1, 7), [0.1, 0.3, 0.5, 0.7, 0.9, 1.0, 1.0], atol=1e-12)


def test_a_target_keeps_its_acceleration_and_stops_at_the_command():
    h, a = 1e-3, 30.0
    q = targets(3.0, a, h, 1500)
    speed = np.diff(q) / h
    assert np.abs(np.diff(speed) / h).max() < 1.01 * a
    assert speed.max() == pytest.approx(3.0, rel=1e-9)
    assert q[-1] == pytest.approx(1.0, abs=a * h**2)  # what one step changes
    assert q.max() < 1.0 + a * h**2
    # A trapezoid: 1/3 s at 3 rad/s covers 1 rad, and both slopes cost half of v/a more.
    assert np.argmax(q > 0.999) * h == pytest.approx(1 / 3 + 0.1, abs=0.01)


def bench(steps=6, **drive):
    scenario = load("servo")
    made = replace(scenario.drive, **({"counts": 0, "off": ()} | drive))
    timing, trajectory = replace(scenario.timing, jitter=0.0), replace(scenario.trajectory, steps=steps)
    return replace(scenario, encoder=ExactEncoder(), timing=timing, trajectory=trajectory, drive=made)


def closed_loop(run, **others):
    """Return positions from the commands of a run by the closed loop of `identify`, which knows no MuJoCo."""
    inertial = 1.04 * 0.1404**2 + 0.0013, 1.04 * 0.1404 * 9.81, 0.0, 0.0
    on = run.log.conditions["on"][:, 0] > 0.5 if "on" in run.log.conditions else None
    load_ = JointLoad(*map(np.array, inertial))
    servo = Servo(0.166, 16.0, supply=12.0, limit=0.97)
    log = ServoRun(run.log.t, run.log.q[0, :, 0], run.log.conditions["command"][0, :, 0], load_, servo, on)
    return ServoLoop([log], 5e-4).simulate(LAW | others)[0, 0]


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("settings", "rms"),
    [({}, 5e-5), ({"backlash": (0.0175,)}, 5e-5), ({"off": ((2.0, 2.6),)}, 3e-4)],
    ids=["rigid", "one degree of free play", "torque off"],
)
def test_two_simulators_agree(settings, rms):
    """MuJoCo with two hinges a joint, and the closed loop of identification, where rotor and link collide without rebound."""
    run = simulate(bench(**settings))
    q = closed_loop(run, **({"backlash": 0.0175} if "backlash" in settings else {}))
    error = run.q[0, :, 0] - q
    # The play itself moves the link by 17 mrad; a fall multiplies what differs at its beginning.
    assert np.sqrt(np.mean(error**2)) < rms
    assert np.abs(error).max() < 10 * rms


@pytest.mark.thorough
def test_without_play_the_geared_plant_is_the_plain_one():
    plain, geared = (simulate(bench(3, backlash=(x,))) for x in (0.0, 1e-6))
    np.testing.assert_allclose(geared.q, plain.q, atol=1e-5)


def test_the_encoder_may_be_before_the_gear():
    """Then positions that are logged leave the play out."""
    run = simulate(bench(4, backlash=(0.0175,), sensed="rotor"))
    gap = run.log.q[0] - run.q[0]
    assert np.abs(gap).max() == pytest.approx(0.0175 / 2, rel=0.02)


def test_a_watcher_receives_back_emf_and_gap():
    heard = []
    run = simulate(bench(2, backlash=(0.0175,)), watch=Watch(heard.append))
    (stretch,) = heard
    assert stretch.by_position
    assert np.abs(stretch.gap).max() <= 0.0175 / 2 * 1.05
    # A mean over a sample, of the rotor, whose link may be at the other end of the play meanwhile.
    between = K * (run.qd[0, 1:] + run.qd[0, :-1]) / 2
    assert np.sqrt(np.mean((stretch.electric.emf[:-1] - between) ** 2)) < 0.02 * np.abs(between).max()


def test_a_log_has_commands_and_when_torque_was_off(tmp_path):
    run = simulate(replace(load("servo"), trajectory=replace(load("servo").trajectory, steps=10)))
    write_log(run.alone(), tmp_path / "log.csv", ("swing",))
    columns, _ = read_servo_log(tmp_path / "log.csv")
    np.testing.assert_allclose(columns.command[:, 0], run.reference.q[:, 0])
    off = np.any([(columns.t >= a - 1e-9) & (columns.t < b - 1e-9) for a, b in load("servo").drive.off], axis=0)
    assert 0 < off.mean() < 1
    np.testing.assert_array_equal(columns.on[:, 0] > 0.5, ~off)


def test_joints_of_one_body_have_no_play(tmp_path):
    file = tmp_path / "cross.xml"
    file.write_text(
        '<mujoco><worldbody><body><inertial pos="0 0 0.1" mass="1" diaginertia="0.1 0.1 0.1"/>'
        '<joint name="x" axis="1 0 0"/><joint name="y" axis="0 1 0"/></body></worldbody></mujoco>'
    )
    scenario = from_dict(to_dict(load("servo-backlash")) | {"robot": str(file)})
    with pytest.raises(RobotError, match="needs a body for each joint"):
        simulate(scenario)


def test_steps_are_equally_long_and_may_come_one_joint_after_the_other():
    scenario = load("servo-arm")
    robot, steps = scenario.real_robot, replace(scenario.trajectory, steps=14)
    first, second = (replace(steps, seed=seed).sample(robot, 100.0) for seed in (1, 2))
    assert len(first.q) == len(second.q)
    moving = (np.abs(np.diff(first.q, axis=0)) > 1e-9).sum(axis=1)
    assert moving.max() == 1
    together = replace(steps, together=True, moves=0.0).sample(robot, 100.0)
    changes = np.diff(together.q, axis=0)
    assert ((changes != 0).sum(axis=1) == robot.n).sum() == 14


def test_a_watched_run_that_fails_says_why():
    scenario = bench(2, kp=(16.0,), armature=(0.0,), torque_constant=(60.0,))
    with pytest.raises(ScenarioError, match="swing"):
        simulate(scenario, watch=Watch(lambda stretch: None))


@pytest.mark.thorough
def test_positions_are_renewed_once_a_period():
    """A log of twice the frequency sees every position twice, and none that is older than a period."""
    plain = replace(load("servo"), fs=200.0, encoder=ExactEncoder(), timing=replace(load("servo").timing, jitter=0.0))
    plain = replace(plain, trajectory=replace(plain.trajectory, steps=4))
    slow = replace(plain, timing=replace(plain.timing, refresh=0.01))
    q, exact = (simulate(scenario).log.q[0, :, 0] for scenario in (slow, plain))
    moving = np.abs(np.diff(exact)) > 1e-6
    repeated = np.diff(q)[moving] == 0
    assert 0.4 < repeated.mean() < 0.6
    assert np.abs(q - exact).max() <= np.abs(exact[2:] - exact[:-2]).max() * (1 + 1e-9)
