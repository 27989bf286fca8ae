"""Drives alone and in a loop: closed forms, a dense integration, limits, lag, energy."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from idbench.sim.drives import DRIVES, AveragedDrive, IdealDrive, SwitchedDrive
from idbench.sim.engine.simulation import simulate
from idbench.sim.engine.watch import Watch
from idbench.sim.errors import RobotError, ScenarioError


def stepped(drive, robot, demand, speed, h, steps):
    amplifier = drive.start(robot, 1, h)
    return amplifier, np.concatenate([amplifier.step(demand[None], speed[None, None], 1)[0] for _ in range(steps)])


def test_averaged_locked_rotor_step_is_the_exponential(robot):
    """Mean torque of every step against the closed form, to 1e-9 of the step."""
    w, h, demand = 2 * np.pi * 1000, 1e-4, np.array([9.0, 2.0])  # within the bus voltage
    _, tau = stepped(AveragedDrive(), robot, demand, np.zeros(2), h, 20)
    t = h * np.arange(21)
    expected = demand * (1 + np.diff(np.exp(-w * t))[:, None] / w / h)
    np.testing.assert_allclose(tau, expected, rtol=1e-9)


def test_averaged_is_the_integral_of_its_equation_where_it_saturates_and_lets_go(robot):
    """Against LSODA with the voltage clipped: mean torque of steps to 1e-6 of the largest."""
    m, h, w = robot.motors, 5e-4, 2 * np.pi * 1000
    drive = AveragedDrive(bus_voltage=(60.0, 30.0), current_limit=(9.0, 4.0)).start(robot, 1, h)
    V, I = np.array([60.0, 30.0]), np.array([9.0, 4.0])  # noqa: E741
    rng, state = np.random.default_rng(5), np.zeros(4)
    for _ in range(30):
        demand, e = rng.uniform(-1, 1, 2) * [70, 9], rng.uniform(-1, 1, 2) * [30, 8]
        tau = drive.step(demand[None], (e / m.K)[None, None], 1)[0, 0]
        wanted = np.clip(demand / m.K, -I, I)

        def rate(t, y, wanted=wanted, e=e):
            reachable = np.clip(wanted, (-V - e) / m.R, (V - e) / m.R)
            v = np.clip(m.R * y[:2] + m.L * w * (reachable - y[:2]) + e, -V, V)
            return [*((v - m.R * y[:2] - e) / m.L), *y[:2]]

        found = solve_ivp(rate, (0, h), [*state[:2], 0, 0], method="LSODA", rtol=1e-10, atol=1e-12, max_step=h / 50)
        np.testing.assert_allclose(tau, m.K * found.y[2:, -1] / h, atol=1e-6 * 70)
        state = found.y[:, -1]


@pytest.mark.parametrize("drive", [AveragedDrive(), SwitchedDrive(dead_time=0.0, duty_resolution=0.0)])
def test_torque_follows_a_ramp_by_the_lag_that_the_drive_states(drive, robot):
    """A slow ramp of the demand: late by its lag, to 2 % of it once settled: pulses are not their mean."""
    h, rate = 1 / 5000, np.array([50.0, 10.0])
    amplifier = drive.start(robot, 1, h)
    middle = (np.arange(400) + 0.5) * h
    tau = np.array([amplifier.step((rate * t)[None], np.zeros((1, 1, 2)), 1)[0, 0] for t in middle])
    late = middle[:, None] - tau / rate
    np.testing.assert_allclose(late[200:].mean(axis=0), drive.lag(robot), rtol=0.02)


def test_an_exact_chopper_gives_the_torque_that_is_asked(robot):
    """Settled, standing and turning: the same torque in every period, however it pulses."""
    for modulation in ("unipolar", "bipolar", "sign_magnitude"):
        drive = SwitchedDrive(modulation=modulation, dead_time=0.0, duty_resolution=0.0).start(robot, 1, 2e-4)
        demand, speed = np.array([[20.0, 3.0]]), np.array([[[3.0, -2.0]]])
        for _ in range(300):
            tau = drive.step(demand, speed, 1)
        # The loop samples the current where the pulses' mean lies but for the winding's resistance within a pulse.
        np.testing.assert_allclose(tau[0], demand, rtol=5e-3)
        np.testing.assert_allclose(drive.step(demand, speed, 1), tau, rtol=1e-9)


@pytest.mark.thorough
def test_the_books_of_energy_close_over_a_move(short):
    """Electrical in = mechanical + copper + stored to 0.1 %; the mechanical work from MuJoCo's motion, not from the drive."""
    heard = []
    run = simulate(replace(short, fs=5000.0, drive=SwitchedDrive()), watch=Watch(heard.append, window=(0.0, np.inf)))
    inner, motors = heard[0].inner, run.robots[0].motors
    work = np.sum(run.tau[0, :-1] * np.diff(run.q[0], axis=0), axis=0)  # mean torque of a period times the way in it
    copper = motors.R * np.sum((run.tau[0] / motors.K) ** 2, axis=0) / 5000
    dt, rise = (np.diff(x.reshape(-1, 3, *x.shape[1:])[:, [0, 2]], axis=1)[:, 0] for x in inner.edges[:2])
    voltage = inner.edges.voltage[1::3]  # constant between edges, so that L di/dt = v - R i - e gives the charge
    charge = ((voltage - inner.electric.emf) * dt - motors.L * rise) / motors.R
    incoming = np.sum(voltage * charge, axis=(0, 1))
    stored = motors.L / 2 * inner.edges.current[-1, -1] ** 2
    # Copper loss from mean currents lacks that of the ripple, which is taken from the drive and must be small.
    ripple = incoming - np.sum(inner.electric.emf * charge, axis=(0, 1)) - stored - copper
    assert (ripple >= 0).all()
    assert (ripple < 0.02 * copper + 0.05).all()
    np.testing.assert_allclose(incoming, work + copper + ripple + stored, rtol=1e-3, atol=1e-3 * np.abs(incoming).max())


def test_a_current_limit_limits_the_torque(robot):
    _, tau = stepped(AveragedDrive(current_limit=(4.0, 1.0)), robot, np.array([100.0, 10.0]), np.zeros(2), 1e-3, 50)
    np.testing.assert_allclose(tau[-1], robot.motors.K * [4.0, 1.0], rtol=1e-9)
    ideal = IdealDrive().start(robot, 1, 1e-3).step(np.array([[100.0, 10.0]]), np.zeros((1, 1, 2)), 1)
    np.testing.assert_array_equal(ideal[0], [[100.0, 10.0]])


def test_a_fast_joint_runs_out_of_voltage(robot):
    """Back-EMF of 5 V s/rad times 30 rad/s leaves 10 V of 160: 10/3 A."""
    _, tau = stepped(AveragedDrive(), robot, np.array([100.0, 0.0]), np.array([30.0, 0.0]), 1e-3, 100)
    np.testing.assert_allclose(tau[-1, 0], 5 * 10 / 3, rtol=1e-9)


@pytest.mark.thorough
def test_without_emf_compensation_a_motor_seems_heavier(short):
    """By K^2 T / (R (1 - a)), from the loop's lag behind a rising back-EMF; the mean torque lacks that times qdd."""
    plain, known = (
        simulate(replace(short, drive=SwitchedDrive(emf_compensation=x, dead_time=0.0, duty_resolution=0.0))) for x in (0, 1)
    )
    m, T = plain.robots[0].motors, 1 / 5000
    apparent = m.K**2 * T / m.R / -np.expm1(-2 * np.pi * 500 * T)
    qdd = np.gradient(plain.qd[0], 0.01, axis=0)
    missing = (known.tau[0] - known.command[0]) - (plain.tau[0] - plain.command[0])
    for j in range(2):
        slope = np.dot(missing[:, j], qdd[:, j]) / np.dot(qdd[:, j], qdd[:, j])
        np.testing.assert_allclose(slope, apparent[j], rtol=0.1)


def test_a_robot_without_motors_is_told(load_robot):
    bare = load_robot('<mujoco><worldbody><body><joint name="hip"/><geom size="1"/></body></worldbody></mujoco>')
    with pytest.raises(RobotError, match="joint hip has no dcmotor of its own in the MJCF"):
        AveragedDrive().start(bare, 1, 1e-3)
    assert isinstance(DRIVES.create("ideal").start(bare, 1, 1e-3).step(np.ones((1, 1)), np.zeros((1, 1, 1)), 1), np.ndarray)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"drive": AveragedDrive(bandwidth=20.0)}, "must be above that of the bare winding, 63.7 Hz"),
        ({"drive": SwitchedDrive(pwm=5050.0)}, "drive.pwm = 5050 Hz must be a whole multiple of fs = 100 Hz"),
        ({"drive": AveragedDrive(current_limit=(1.0, 2.0, 3.0))}, "drive.current_limit has 3 values for 2 joints"),
    ],
)
def test_settings_that_do_not_fit_the_motors_are_told(short, change, message):
    with pytest.raises(ScenarioError, match=message):
        simulate(replace(short, **change))
