"""Servos, against MuJoCo's own: `dcmotor` with input="pos" closes the same loop."""

from dataclasses import replace

import mujoco
import numpy as np
import pytest
from builders import pendulum

from idbench.identify import ExcitationError, IdentificationError, LogError, SettingError
from idbench.identify.servo import JointLoad, Servo, ServoRun, identify_servo
from idbench.identify.servo.run import pieces

SERVO = Servo(0.166, supply=12.0, limit=0.97, counts=4096)
MASS, LENGTH, H, DELAY = 0.6, 0.12, 5e-4, 0.02
TRUTH = {"a": 0.55, "b": 1.2, "Ia": 0.02, "Fs": 0.1, "rate": 4.5, "delay": DELAY}

MJCF = """
<mujoco>
  <option timestep="{h}" integrator="implicitfast"/>
  <worldbody><body><joint name="j" axis="0 -1 0" armature="{Ia}" frictionloss="{Fs}" damping="0"/>
    <inertial pos="0 0 -{length}" mass="{mass}" diaginertia="1e-9 1e-9 1e-9"/></body></worldbody>
  <actuator>
    <dcmotor joint="j" motorconst="{K}" resistance="{R}" input="pos" controller="{kp} 0 {b} {rate} 0 {Vmax}"/>
  </actuator>
</mujoco>
"""


def command_at(t: np.ndarray, seed: int) -> np.ndarray:
    """Return steps and sines as they are typed at a bench, held at 100 Hz."""
    rng = np.random.default_rng(seed)
    grid = np.floor(t * 100 + 1e-9) / 100
    steps = rng.uniform(-1.2, 1.2, 12)[np.minimum((grid / 0.7).astype(int), 11)]
    waves = 0.3 * np.sin(2 * np.pi * rng.uniform(0.5, 2.0) * grid) + 0.1 * np.sin(2 * np.pi * 3 * grid)
    return steps + waves


def simulated(kp: float, seed: int, seconds: float = 8.0, mass: float = MASS) -> ServoRun:
    """Return a run of MuJoCo's servo, its positions in counts."""
    K = TRUTH["b"] / TRUTH["a"]
    text = MJCF.format(
        h=H, length=LENGTH, mass=mass, Ia=TRUTH["Ia"], Fs=TRUTH["Fs"], K=K, R=K / TRUTH["a"], b=TRUTH["b"],
        kp=SERVO.gain * kp * SERVO.supply * TRUTH["a"], rate=TRUTH["rate"], Vmax=SERVO.limit * SERVO.supply,
    )  # fmt: skip
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    t = np.arange(0, seconds, H)
    ctrl = command_at(np.maximum(t - DELAY, 0.0), seed)
    data.qpos[0] = 0.0
    q = np.empty(len(t))
    for k, u in enumerate(ctrl):
        q[k] = data.qpos[0]
        data.ctrl[0] = u
        mujoco.mj_step(model, data)
    every = round(0.01 / H)
    counted = np.round(q[::every] / SERVO.count) * SERVO.count
    return ServoRun(t[::every], counted, command_at(t[::every], seed), pendulum(MASS, LENGTH), replace(SERVO, kp=kp))


@pytest.fixture(scope="module")
def runs() -> list[ServoRun]:
    return [simulated(kp, seed) for seed, kp in enumerate((8.0, 16.0, 32.0))]


def test_parameters_of_mujocos_servo_are_found(runs: list[ServoRun]) -> None:
    fit = identify_servo(runs, "coulomb")
    # The truth is of first order in H: commands act up to 1.5 steps early, and implicit damping adds b H to the inertia.
    effective = {**TRUTH, "Ia": TRUTH["Ia"] + TRUTH["b"] * H, "delay": DELAY - 1.3 * H}
    for name, true in effective.items():
        assert abs(fit.p[name] - true) < 4 * fit.standard_errors[name] + 0.005 * true, name
    assert fit.scale < 0.35 * SERVO.count  # rounding alone leaves 0.25
    assert fit.errors([simulated(24.0, 7)])[0] < 3 * SERVO.count


def test_command_in_degrees_is_refused(runs: list[ServoRun]) -> None:
    run = runs[0]
    wrong = ServoRun(run.t, run.q, np.rad2deg(run.command), run.load, run.servo)
    with pytest.raises(IdentificationError, match="in degrees"):
        identify_servo([wrong])


def test_standing_joint_is_refused(runs: list[ServoRun]) -> None:
    run = runs[0]
    with pytest.raises(ExcitationError, match="does not move"):
        identify_servo([ServoRun(run.t, 0 * run.q, run.command, run.load, run.servo)])


def test_torque_off_all_the_time_is_refused(runs: list[ServoRun]) -> None:
    run = runs[0]
    with pytest.raises(ExcitationError, match="off all the time"):
        identify_servo([ServoRun(run.t, run.q, run.command, run.load, run.servo, np.zeros(len(run.t), bool))])


def test_saturated_duty_is_refused(runs: list[ServoRun]) -> None:
    run = runs[0]
    with pytest.raises(ExcitationError, match="at its limit"):
        identify_servo([ServoRun(run.t, run.q, run.q + 3.0 * np.sign(run.command), run.load, replace(SERVO, kp=200.0))])


def test_a_joint_without_a_load_is_known_up_to_a_factor(runs: list[ServoRun]) -> None:
    """Nothing sets the scale of its torques: ratios are found, and positions follow."""
    load = JointLoad(np.array(MASS * LENGTH**2 * 1e-6), *(np.array(0.0),) * 3)
    light = [simulated(kp, seed, mass=MASS * 1e-6) for seed, kp in enumerate((8.0, 16.0))]
    fit = identify_servo([replace(run, load=load) for run in light], "coulomb")
    assert not fit.scaled
    assert fit.factor[0] < 0.1
    assert fit.factor[1] > 10
    assert fit.p["b"] / fit.p["a"] == pytest.approx(TRUTH["b"] / TRUTH["a"], rel=0.02)
    assert fit.errors(fit.loop.runs).mean() < 3 * SERVO.count


def test_command_with_the_wrong_sign_is_refused(runs: list[ServoRun]) -> None:
    run = runs[0]
    with pytest.raises(IdentificationError, match="sign"):
        identify_servo([ServoRun(run.t, run.q, -run.command, run.load, run.servo)])


def test_unknown_names_are_refused(runs: list[ServoRun]) -> None:
    with pytest.raises(SettingError, match="coulomb"):
        identify_servo(runs, "sticky")
    with pytest.raises(SettingError, match="no parameter"):
        identify_servo(runs, "load", ("gap",))


def test_time_that_stands_is_refused(runs: list[ServoRun]) -> None:
    run = runs[0]
    t = run.t.copy()
    t[5] = t[4]
    with pytest.raises(LogError, match="does not increase"):
        ServoRun(t, run.q, run.command, run.load, run.servo)


STEPS = np.repeat([0.0, 0.5, -0.3], 200)
RESTING = [0, 2, 2.5, 4, 4.5, 6]
"""Commands of 6 s, and when a joint that follows them starts and stops [s]."""


def pieces_of(q, command, settled=0.03):
    run = ServoRun(np.arange(len(q)) * 0.01, q, command, pendulum(0.5, 0.1), SERVO)
    return pieces(run, settled)


def following(turns):
    return np.interp(np.arange(600) * 0.01, turns, [0.0, 0.0, 0.5, 0.5, -0.3, -0.3])


def test_pieces_begin_at_rest_and_leave_nothing_out_that_moves():
    """But a motion that was under way when the log began: how it began is not known."""
    still = following(RESTING)
    moving = still + 0.1 * np.clip(1 - np.arange(600) * 0.01 / 0.3, 0, None)
    for q in (moving, still):
        parts = pieces_of(q, STEPS)
        assert all(part.q[0] == part.q[1] and part.command[0] == part.command[1] for part in parts)
        assert sum(np.abs(np.diff(part.q)).sum() for part in parts) == pytest.approx(1.3)
        assert max(part.t[-1] - part.t[0] for part in parts) < 2.5


def test_a_run_that_never_rests_is_one_piece():
    wave = np.sin(np.arange(600) * 0.01)
    assert len(pieces_of(wave, wave)) == 1


def test_pieces_begin_when_a_late_command_has_arrived():
    """A joint that rests because its command is late has a target that is still on its way."""
    starts = [part.t[0] for part in pieces_of(following([0, 2.3, 2.8, 4.3, 4.8, 6]), STEPS, 0.3)][1:]
    assert len(starts) > 0
    changed = np.array([2.0, 4.0])
    assert all(not ((changed < s) & (changed > s - 0.4)).any() for s in starts)


def test_the_only_motion_of_a_log_is_kept():
    """A step at once, and then rest: without the step there would be nothing."""
    (first, *_) = pieces_of(np.interp(np.arange(200) * 0.01, [0, 0.3], [0.0, 0.5]), np.full(200, 0.5))
    assert np.ptp(first.q) == pytest.approx(0.5)
