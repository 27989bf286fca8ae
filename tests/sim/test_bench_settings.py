"""Every setting of a scenario that is not a drive's or an encoder's shows its physical effect in a loop."""

from dataclasses import replace

import mujoco
import numpy as np
import pytest

from idbench import models
from idbench.sim.controllers import PID, AbstractController, AbstractLaw, ComputedTorque, PDFeedforward
from idbench.sim.drives import AveragedDrive
from idbench.sim.engine.simulation import simulate
from idbench.sim.errors import ScenarioError
from idbench.sim.frictions import CoulombViscous, LuGre, Stribeck
from idbench.sim.robot.payload import Payload
from idbench.sim.robot.robot import Robot
from idbench.sim.robot.scara import scara_truth
from idbench.sim.scenario.measurement import Ripple, TorqueMeasurement
from idbench.sim.scenario.scenario import Physics, Timing
from idbench.sim.settings import settings
from idbench.sim.trajectories import Quintic

WAIT = Quintic(((0.3, 0.2), (0.3, 0.2)), (1.0,), 0.2)


def tail(run):
    """Return how the joints move after the end of the motion."""
    return run.qd[0, -28:]


def tracking(run):
    return np.abs(run.reference.q - run.q[0]).max(axis=0)


@pytest.mark.parametrize("controller", [PDFeedforward(), ComputedTorque()])
def test_a_controller_that_knows_the_robot_tracks(short, controller):
    """Within what Coulomb friction, which it does not know, and a held command leave: Fs / (M w^2) is 0.7 and 7 mrad."""
    assert (tracking(simulate(replace(short, controller=controller))) < [0.006, 0.03]).all()


def test_a_controller_that_knows_less_tracks_worse(short):
    good, half, none, pid = (
        tracking(simulate(replace(short, controller=c)))
        for c in (PDFeedforward(), PDFeedforward(feedforward=0.5), PDFeedforward(feedforward=0.0), PID())
    )
    assert (good < half).all()
    assert (half < none).all()
    assert (pid > good).all()
    wrong = tracking(simulate(replace(short, controller=ComputedTorque(model_error=0.3))))
    assert (wrong > tracking(simulate(replace(short, controller=ComputedTorque())))).all()


def test_bandwidth_damping_and_cutoff_act_on_the_loop(short):
    base = tracking(simulate(replace(short, controller=PDFeedforward(feedforward=0.5))))
    assert (tracking(simulate(replace(short, controller=PDFeedforward(feedforward=0.5, bandwidth=25.0)))) < base).all()
    # Without feedforward a weakly damped loop swings after the motion has ended, and one with a slow derivative too.
    pushed = PDFeedforward(feedforward=0.0, bandwidth=10.0)
    swings = [
        np.abs(simulate(replace(short, controller=replace(pushed, **change))).qd[0, -28:]).max()
        for change in ({}, {"damping": 0.5}, {"cutoff": 2.0})
    ]
    assert swings[1] > 1.5 * swings[0]
    assert swings[2] > 1.5 * swings[0]


def test_pid_brings_the_error_at_rest_to_zero(short):
    """After a move with an unknown payload the integrator leaves nothing."""
    long = replace(short, trajectory=Quintic(((0.0, 0.0), (0.2, 0.2)), (0.5,), 4.0), friction=CoulombViscous(coulomb=0.0))
    pid = simulate(replace(long, controller=PID(), payload=Payload(mass=1.0)))
    assert np.abs(pid.reference.q[-1] - pid.q[0, -1]).max() < 1e-4


@pytest.mark.thorough
def test_a_loop_at_5_khz_works(short):
    run = simulate(replace(short, fs=5000.0, controller=PDFeedforward(bandwidth=30.0)))
    assert run.log.samples == 16500
    assert (tracking(run) < [0.003, 0.01]).all()


def test_the_computing_delay_makes_commands_act_later(short):
    """The torque in a sample's period is the share of the old command and of the new one."""
    for delay in (0.0025, 0.01, 0.0137):
        run = simulate(replace(short, timing=Timing(delay=delay)))
        k, share = divmod(delay, 0.01)
        old, new = (run.command[0][5 - int(k) - i : -5 - int(k) - i] for i in (1, 0))
        np.testing.assert_allclose(run.tau[0][5:-5], share / 0.01 * old + (1 - share / 0.01) * new, atol=1e-9)
        assert run.log.torque.delay == pytest.approx(delay)


def test_jitter_moves_the_instants_of_the_positions(short):
    """What is read lies off the true position by the velocity times at most half the width, evenly."""
    run = simulate(replace(short, timing=Timing(delay=0.003, jitter=0.002)))
    fast = np.abs(run.qd[0]) > 0.5
    off = ((run.log.q - run.q)[0] / np.where(fast, run.qd[0], 1.0))[fast]
    assert 0.0009 < np.abs(off).max() < 0.00102
    assert off.std() == pytest.approx(0.002 / np.sqrt(12), rel=0.1)
    with pytest.raises(ScenarioError, match=r"timing.jitter = 0.002 s needs a timing.delay of at least its half"):
        simulate(replace(short, timing=Timing(jitter=0.002)))


def test_integrators_that_act_early_say_so(short):
    for integrator in ("Euler", "implicitfast", "implicit"):
        run = simulate(replace(short, physics=Physics(step=5e-4, integrator=integrator)))
        assert run.log.torque.delay == pytest.approx(-2.5e-4)
    assert simulate(short).log.torque.delay == 0.0


def test_a_coarser_step_is_another_simulation_close_by(short):
    fine, coarse = (simulate(replace(short, physics=Physics(step=h))).q for h in (5e-4, 2e-3))
    assert 0 < np.abs(fine - coarse).max() < 1e-4


def test_cogging_is_the_motors_own_and_commutation_a_share_of_the_current(short):
    waiting = replace(short, trajectory=WAIT, friction=CoulombViscous(coulomb=(50.0, 5.0)))
    model, data = short.real_robot.model, mujoco.MjData(short.real_robot.model)
    run = simulate(replace(waiting, ripple=Ripple(cogging=2.0)))
    data.qpos[:] = run.q[0, 10]
    data.act[:], data.ctrl[:] = 0.0, 0.0
    mujoco.mj_forward(model, data)
    np.testing.assert_allclose((run.tau - run.command)[0, 10], 2 * data.qfrc_actuator, atol=1e-6)
    third = simulate(replace(waiting, ripple=Ripple(cogging=1.0, cogging_harmonics=(0.0, 0.0, 1.0))))
    motors = run.robots[0].motors
    expected = motors.cogging * np.sin(3 * motors.order * third.q[0, 10])
    np.testing.assert_allclose((third.tau - third.command)[0, 10], expected, atol=1e-6)


def test_commutation_multiplies_the_torque(short):
    ripple = Ripple(commutation=0.1, commutator_bars=(5, 3), commutation_harmonics=(1.0, 0.5))
    run = simulate(replace(short, fs=1000.0, ripple=ripple, controller=PDFeedforward(bandwidth=20.0)))
    q = run.q[0] + run.qd[0] * 5e-4
    angle = q * [5, 3]
    share = 1 + 0.1 * (np.sin(angle) + 0.5 * np.sin(2 * angle))
    np.testing.assert_allclose(run.tau[0], run.command[0] * share, atol=2e-3)


def test_a_payload_is_in_the_truth_and_unknown_to_the_controller(short):
    loaded = replace(short, payload=Payload(mass=0.5, position=(0.2, 0.1, 0.0), inertia=0.003))
    gained = {k: v - scara_truth(short.real_robot)[k] for k, v in scara_truth(loaded.real_robot).items()}
    expected = {"ZZR1": 0.5 * 0.25, "ZZ2": 0.003 + 0.5 * 0.05, "LMX2": 0.5 * 0.5 * 0.2, "LMY2": 0.5 * 0.5 * 0.1}
    np.testing.assert_allclose([gained[k] for k in gained], [expected.get(k, 0.0) for k in gained], atol=1e-12)
    assert (tracking(simulate(loaded)) > tracking(simulate(short))).all()
    steel = replace(loaded, payload=Payload(mass=0.5)).real_robot
    ball = 0.4 * 0.5 * (3 * 0.5 / 4 / np.pi / 7850) ** (2 / 3)
    np.testing.assert_allclose(steel.model.body("payload").inertia, ball)
    with pytest.raises(ScenarioError, match=r"payload.inertia = 1 kg m\^2 needs a payload.mass"):
        _ = replace(short, payload=Payload(inertia=1.0)).real_robot


def test_friction_of_the_scenario_replaces_that_of_the_robot(short):
    robot = replace(short, friction=CoulombViscous(viscous=(0.3, 0.06), coulomb=0.2)).real_robot
    truth = scara_truth(robot)
    assert [truth[x] for x in ("Fv1", "Fv2", "Fs1", "Fs2")] == [0.3, 0.06, 0.2, 0.2]
    with pytest.raises(ScenarioError, match=r"friction.viscous has 3 values for 2 joints"):
        _ = replace(short, friction=CoulombViscous(viscous=(1.0, 2.0, 3.0))).real_robot


@pytest.mark.thorough
@pytest.mark.parametrize("law", [Stribeck(static=1.6, velocity=0.3), LuGre(static=1.6, velocity=0.3)])
def test_slow_motion_meets_the_stribeck_curve(short, law):
    """A steady creep: torque = Fs (1 + (static - 1) exp(-(qd/velocity)^2)) + Fv qd, measured in the middle of long moves."""
    creep = Quintic(((0.0, 0.0), (0.8, -0.6)), (6.0,), 0.2)
    run = simulate(replace(short, trajectory=creep, friction=law, fs=500.0, controller=PDFeedforward(bandwidth=25.0)))
    qdd = np.gradient(run.qd[0], 1 / 500, axis=0)
    middle = slice(1200, 2000)
    inertial = run.tau[0] - np.array([0.05, 0.01]) * run.qd[0]
    M = np.array([[3.5 + 0.06 + 0.24, 0.06 + 0.12], [0.06 + 0.12, 0.06]])
    friction = (inertial - qdd @ M.T)[middle].mean(axis=0)
    qd = run.qd[0, middle].mean(axis=0)
    expected = np.array([0.5, 0.1]) * (1 + 0.6 * np.exp(-((qd / 0.3) ** 2))) * np.sign(qd)
    np.testing.assert_allclose(friction, expected, rtol=0.05)


def test_lugre_sticks(short):
    """Standing under a load below static friction the joint stays, bent by the bristles alone."""
    still = replace(short, trajectory=WAIT, friction=LuGre(deflection=1e-3), ripple=Ripple(cogging=1.0))
    run = simulate(still)
    assert np.abs(run.q[0] - run.q[0, 0]).max() < 2e-3
    assert np.abs(run.qd[0, 60:]).max() < 1e-4
    with pytest.raises(ScenarioError, match=r"friction.deflection = 1e-06 rad makes bristles that swing within"):
        simulate(replace(short, friction=LuGre(deflection=1e-6)))


def test_the_log_has_gain_error_offset_noise_and_steps(short):
    clean = simulate(short)
    for j, (gain, offset) in enumerate([(0.02, 0.3), (-0.01, -0.1)]):
        said = simulate(replace(short, torque=TorqueMeasurement(gain_error=(0.02, -0.01), offset=(0.3, -0.1)))).log.tau[0, :, j]
        np.testing.assert_allclose(said, (1 + gain) * clean.log.tau[0, :, j] + offset, atol=1e-12)
    noisy = simulate(replace(short, torque=TorqueMeasurement(noise=(0.5, 0.02))))
    np.testing.assert_allclose((noisy.log.tau - clean.log.tau).std(axis=1)[0], [0.5, 0.02], rtol=0.15)
    stepped = simulate(replace(short, torque=TorqueMeasurement(resolution=(0.5, 0.1)))).log.tau[0] / [0.5, 0.1]
    np.testing.assert_allclose(stepped, np.rint(stepped), atol=1e-9)


def test_a_measured_current_is_the_command_of_the_period_before(short):
    run = simulate(replace(short, torque=TorqueMeasurement(source="current")))
    np.testing.assert_allclose(run.log.tau[0, 1:], run.command[0, :-1], atol=1e-12)
    assert run.log.torque.meaning == "held"
    assert run.log.torque.delay == pytest.approx(-0.01)


RISE = 1e-4  # Torque by which each command is above the one before [N m]: too small to move a joint


class RampLaw(AbstractLaw):
    def command(self, k, q):
        return np.full(q.shape, RISE * k)


@settings
class Ramp(AbstractController):
    """Commands a torque that rises."""

    def start(self, task):
        return RampLaw()


@pytest.mark.parametrize("cutoff", [20.0, 100.0, 1000.0])
@pytest.mark.parametrize("delay", [0.0, 0.0035, 0.012])
def test_a_filtered_current_states_its_mean_delay(short, cutoff, delay):
    """A ramp of commands: what the sensor says is the command of `delay` later, and the channel knows it."""
    torque = TorqueMeasurement(source="current", cutoff=cutoff)
    run = simulate(replace(short, torque=torque, timing=Timing(delay=delay), controller=Ramp(), physics=Physics(step=5e-4)))
    # Sample k speaks for the command u_i with t_i + delay = t_k + channel.delay.
    expected = RISE * (np.arange(run.log.samples) + (torque.channel(delay, 0.0, 100.0).delay - delay) / 0.01)
    np.testing.assert_allclose(run.log.tau[0, 60:, 0], expected[60:], atol=1e-6 * RISE)


def test_the_arm_is_brought_to_the_start_before_the_log_begins(short):
    run = simulate(replace(short, start=(0.5, -0.5)))
    assert run.log.samples == simulate(short).log.samples
    assert np.abs(run.q[0, 0] - [0.0, 0.0]).max() < 0.01  # Fs / (M w^2) is 7 mrad at joint 2
    with pytest.raises(ScenarioError, match="the trajectory moves 3 joints"):
        simulate(replace(short, start=(0.0, 0.0, 0.0)))
    with pytest.raises(ScenarioError, match="joint1 would move"):
        simulate(replace(short, start=(5.0, 0.0)))


def test_saturation_makes_the_log_say_more_than_acts(short):
    run = simulate(replace(short, drive=AveragedDrive(current_limit=(3.0, 3.0))))
    assert np.abs(run.log.tau[0, :, 0]).max() > 20
    assert np.abs(run.tau[0, :, 0]).max() <= 15 + 1e-9


def test_another_robot_may_be_named(short, tmp_path):
    path = tmp_path / "other.xml"
    spec = mujoco.MjSpec.from_file(str(models.path("scara")))
    spec.joint("joint1").armature = 1.25
    path.write_text(spec.to_xml())
    run = simulate(replace(short, robot=str(path)))
    assert scara_truth(run.robots[0])["ZZR1"] == pytest.approx(4.5)
    assert isinstance(run.robots[0], Robot)
