"""The engine: same bits at any batch, thread count and order; what varies between simulations; what it refuses."""

from dataclasses import replace

import numpy as np
import pytest

from idbench.identify import scara
from idbench.identify.judge.delay import estimate_delay
from idbench.sim.controllers import CONTROLLERS, ComputedTorque, PDFeedforward
from idbench.sim.drives import AveragedDrive, ServoDrive, SwitchedDrive
from idbench.sim.drives.drive import AbstractAmplifier, AbstractDrive
from idbench.sim.encoders import IncrementalEncoder
from idbench.sim.engine.simulation import simulate
from idbench.sim.errors import ScenarioError
from idbench.sim.frictions import LuGre, Stribeck
from idbench.sim.frictions.friction_law import AbstractContact, AbstractFrictionLaw
from idbench.sim.robot.scara import scara_truth
from idbench.sim.scenario.measurement import Ripple, TorqueMeasurement
from idbench.sim.scenario.scenario import Physics, Timing
from idbench.sim.settings import settings
from idbench.sim.trajectories import Quintic, RandomMoves

BUSY = {
    "controller": ComputedTorque(model_error=0.1),
    "timing": Timing(delay=0.0034, jitter=0.001),
    "ripple": Ripple(cogging=1.0, commutation=0.02),
    "encoder": IncrementalEncoder(lines=2000, noise=1e-4, missed_counts=1.0, interpolation_error=0.01),
    "torque": TorqueMeasurement(source="current", noise=0.1, cutoff=200.0),
    "trajectory": Quintic(((0.0, 0.0), (0.6, -0.5), (0.0, 0.2)), (0.4, 0.4), 0.1),
}
"""Everything that is random or remembers something."""


@pytest.mark.thorough
@pytest.mark.parametrize(
    "parts",
    [
        {"drive": AveragedDrive(bus_voltage=60.0), "friction": LuGre()},
        {"drive": SwitchedDrive(), "friction": Stribeck()},
    ],
    ids=["averaged", "switched"],
)
def test_a_simulation_has_the_same_bits_whatever_runs_beside_it(short, parts):
    busy = replace(short, **BUSY, **parts)
    together = simulate(busy, range(5), threads=2)
    for seeds, threads in (((3,), 1), ((4, 3), 2), ((3, 0, 1, 2, 3, 4), 1)):
        other = simulate(busy, seeds, threads=threads)
        for name in ("q", "qd", "tau", "command"):
            np.testing.assert_array_equal(getattr(other, name)[seeds.index(3)], getattr(together, name)[3])
        np.testing.assert_array_equal(other.log.q[seeds.index(3)], together.log.q[3])
        np.testing.assert_array_equal(other.log.tau[seeds.index(3)], together.log.tau[3])
    assert not np.array_equal(together.log.q[0], together.log.q[1])


def test_parameters_may_vary_between_simulations(short):
    """Three viscous frictions and masses in one batch: each robot knows its own, and the first moves as it does alone."""
    damping = np.array([[0.05, 0.01], [0.3, 0.02], [0.1, 0.05]])
    mass = np.tile(short.real_robot.model.body_mass, (3, 1))
    mass[2, -1] = 2.5
    run = simulate(short, (0, 0, 0), vary={"dof_damping": damping, "body_mass": mass})
    np.testing.assert_array_equal(run.q[0], simulate(short).q[0])
    assert [scara_truth(robot)["Fv1"] for robot in run.robots] == [0.05, 0.3, 0.1]
    assert scara_truth(run.robots[2])["LMX2"] == pytest.approx(0.15)


@pytest.mark.parametrize(
    ("vary", "message"),
    [
        ({"dof_dampin": [[1.0, 1.0]]}, "MuJoCo's model has no field 'dof_dampin'"),
        ({"dof_damping": [1.0, 1.0]}, r"vary: dof_damping needs the shape \(1, 2\), not \(2,\)"),
    ],
)
def test_what_cannot_vary_is_told(short, vary, message):
    with pytest.raises(ScenarioError, match=message):
        simulate(short, vary=vary)


def test_an_unstable_loop_is_told_with_joint_and_time(short):
    wild = replace(short, controller=PDFeedforward(bandwidth=90.0), timing=Timing(delay=0.03))
    with pytest.raises(ScenarioError, match=r"joint joint\d runs away at .* rad/s .* s after the start \(seed 0\): the loop"):
        simulate(wild)


def test_a_joint_that_leaves_its_range_is_told(short):
    weak = replace(short, controller=PDFeedforward(bandwidth=0.3, feedforward=3.0))
    with pytest.raises(ScenarioError, match=r"joint joint\d leaves its range .* s after the start"):
        simulate(weak)


FREE = """
<mujoco><worldbody>
  <body><joint name="turn" axis="0 0 1"/><geom size="0.1" pos="0.1 0 0"/>
    <body pos="0.1 0 0"><joint name="reach" type="slide" axis="1 0 0" damping="3"/><geom size="0.1"/></body></body>
</worldbody></mujoco>
"""
"""A hinge and a slide that nothing stops."""


@pytest.mark.thorough
@pytest.mark.parametrize(("bandwidth", "delay"), [(60.0, 0.009), (200.0, 0.009), (600.0, 0.0), (2000.0, 0.0)])
def test_a_loop_that_runs_away_without_a_range_fails_quietly(ideal, tmp_path, monkeypatch, capfd, bandwidth, delay):
    """MuJoCo would warn of Nan and begin anew; neither it nor NumPy prints, or writes MUJOCO_LOG.TXT."""
    (tmp_path / "free.xml").write_text(FREE)
    monkeypatch.chdir(tmp_path)
    wild = replace(
        ideal,
        fs=1000.0,
        robot=str(tmp_path / "free.xml"),
        trajectory=RandomMoves(moves=4, velocity=(2.0,)),
        controller=PDFeedforward(bandwidth=bandwidth),
        timing=Timing(delay=delay),
    )
    run = simulate(wild, (0, 1), throw=False)
    assert list(run.failures) == [0, 1]
    assert all("the loop is unstable" in reason for reason in run.failures.values())
    assert np.isfinite(run.q).all()
    assert capfd.readouterr() == ("", "")
    assert [path.name for path in tmp_path.iterdir()] == ["free.xml"]


def sick(torques, calls):
    """Torques of which those of joint 1 of the second simulation have no size after 40 calls."""
    calls.append(1)
    torques = np.array(torques)
    if len(calls) > 40:
        torques[..., 1, 0] = np.nan
    return torques


class SickDrive(AbstractAmplifier):
    def __init__(self):
        self.calls = []

    def step(self, demand, speed, steps):
        return sick(demand[None], self.calls)

    def electric(self, trace, dt):
        raise AssertionError("nobody watches")


class SickContact(AbstractContact):
    def __init__(self):
        self.calls = []

    def torque(self, qd):
        return sick(np.zeros_like(qd), self.calls)


@settings
class SickFriction(AbstractFrictionLaw):
    """Breaks after a while."""

    def start(self, plant, Fs, h):
        return SickContact()


@settings
class SickMotors(AbstractDrive):
    """Breaks after a while."""

    def start(self, robot, nsim, h):
        return SickDrive()

    def lag(self, robot):
        return np.zeros(robot.n)


@pytest.mark.parametrize(("part", "made"), [("drive", SickMotors()), ("friction", SickFriction())])
def test_a_torque_that_is_not_finite_is_blamed_on_its_part(short, part, made):
    run = simulate(replace(short, **{part: made}), (3, 5), throw=False)
    assert run.failures == {1: f"the {part} gives no finite torque (seed 5)"}


def test_progress_is_told_about_a_hundred_times_and_grows(short):
    heard = []
    simulate(short, progress=heard.append)
    assert 80 < len(heard) <= 101
    assert heard == sorted(heard)
    assert heard[-1] <= 1


def test_the_log_is_what_the_parts_make_of_the_truth(short):
    """Exact encoder, ideal drive: positions and commands themselves; all channels have the shape (nsim, time, joint)."""
    run = simulate(short, (0, 7))
    np.testing.assert_array_equal(run.log.q, run.q)
    np.testing.assert_array_equal(run.log.tau, run.command)
    np.testing.assert_allclose(run.tau, run.command, atol=1e-12)
    assert run.q.shape == run.qd.shape == run.tau.shape == (2, 330, 2)
    np.testing.assert_array_equal(run.alone(1).q, run.log.q[1])


def test_a_held_torque_moves_the_arm_by_newtons_law(short):
    """Momentum of the whole arm about joint 1 changes by the impulse of its motor less friction: an independent balance."""
    run = simulate(replace(short, friction=replace(short.friction, viscous=0.0, coulomb=0.0)))
    q2, (v1, v2) = run.q[0, :, 1], run.qd[0].T
    coupling = 0.12 * np.cos(q2) - 0.005 * np.sin(q2)
    momentum = (3.5 + 0.06 + 2 * coupling) * v1 + (0.06 + coupling) * v2
    np.testing.assert_allclose(np.diff(momentum), 0.01 * run.tau[0, :-1, 0], atol=1e-9)


@pytest.mark.thorough
@pytest.mark.parametrize("delay", [0.00105, 0.0134])
@pytest.mark.parametrize(
    "parts",
    [
        {},
        {"drive": AveragedDrive()},
        {"drive": SwitchedDrive(dead_time=0.0)},
        {"ripple": Ripple(cogging=0.01), "physics": Physics(step=1e-4)},
        {"physics": Physics(step=1e-3, integrator="implicitfast")},
        {"torque": TorqueMeasurement(source="current")},
        {"torque": TorqueMeasurement(source="current", cutoff=100.0), "physics": Physics(integrator="implicitfast")},
        {"drive": AveragedDrive(bandwidth=300.0), "torque": TorqueMeasurement(source="current")},
    ],
    ids=["ideal", "averaged", "switched", "ripple", "early", "current", "filtered", "slow loop"],
)
def test_the_log_states_the_delay_that_it_has(ideal, parts, delay):
    """What is estimated from the log alone is what the channel says, to 0.1 ms, a hundredth of a sample."""
    controller = PDFeedforward(bandwidth=8.0)
    moves = RandomMoves(moves=6, rest=0.6)
    log = simulate(replace(ideal, trajectory=moves, controller=controller, timing=Timing(delay=delay), **parts)).alone()
    assert estimate_delay(log, scara()).delay == pytest.approx(log.torque.delay, abs=1e-4)


def test_parameters_that_a_friction_law_uses_are_still_the_truth(short):
    """Stribeck and LuGre write into MuJoCo's friction while they run; the robots keep theirs."""
    for law in (Stribeck(), LuGre()):
        run = simulate(replace(short, friction=law), vary={"dof_frictionloss": [[0.6, 0.2]]})
        assert [scara_truth(run.robots[0])[x] for x in ("Fs1", "Fs2")] == [0.6, 0.2]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"timing": Timing(delay=0.05, jitter=0.02)}, r"timing.jitter = 0.02 s must be below 1/fs = 0.01 s"),
        ({"trajectory": Quintic(((0.0, 0.0), (1.0, 1.0)), (0.004,), 0.0)}, "makes 0.4 samples of this motion"),
    ],
)
def test_impossible_times_are_told(short, change, message):
    with pytest.raises(ScenarioError, match=message):
        simulate(replace(short, **change))


def test_a_robot_of_one_joint_runs(written, short):
    path = written(
        '<mujoco><option gravity="0 0 -9.81"/><worldbody><body><inertial pos="0.3 0 0" mass="1" diaginertia="0.1 0.1 0.1"/>'
        '<joint name="hip" axis="0 1 0" damping="0.1"/></body></worldbody></mujoco>'
    )
    moves = Quintic(((0.0,), (1.0,), (-0.5,)), (1.0, 1.0), 0.2)
    run = simulate(replace(short, robot=path, trajectory=moves))
    assert np.abs(run.reference.q - run.q[0]).max() < 0.02
    gravity = -9.81 * 0.3 * np.cos(run.q[0, 0, 0])  # about y, a positive angle lowers the arm
    np.testing.assert_allclose(run.command[0, 0, 0], gravity, atol=1e-9)


def test_a_simulation_that_fails_ends_alone(short):
    """One of three is driven away by a negative friction: it says why, and the others do not notice."""
    damping = np.array([[0.05, 0.01], [-400.0, 0.01], [0.05, 0.01]])
    busy = replace(short, **BUSY)
    with pytest.raises(ScenarioError, match="runs away"):
        simulate(busy, (1, 2, 3), vary={"dof_damping": damping})
    run = simulate(busy, (1, 2, 3), vary={"dof_damping": damping}, throw=False)
    assert list(run.failures) == [1]
    assert "(seed 2)" in run.failures[1]
    alone = simulate(busy, (3,))
    np.testing.assert_array_equal(run.log.tau[2], alone.log.tau[0])
    np.testing.assert_array_equal(run.log.q[2], alone.log.q[0])


@pytest.mark.thorough
@pytest.mark.parametrize("controller", CONTROLLERS.builtin)
def test_every_simulation_may_have_a_motion_of_its_own(short, robot, controller):
    """With the bits that it has as the trajectory of a scenario."""
    kinds = [RandomMoves(moves=1, durations=(1.3, 1.3), rest=0.05, seed=seed) for seed in (4, 5, 6)]
    calm = {"controller": CONTROLLERS.create(controller), "timing": Timing(), "encoder": IncrementalEncoder()}
    if calm["controller"].commanded == "position":
        calm |= {"drive": ServoDrive()}
    busy = replace(short, **BUSY | calm)
    run = simulate(busy, (1, 2, 3), motions=[kind.sample(robot, busy.fs) for kind in kinds])
    for i, kind in enumerate(kinds):
        alone = simulate(replace(busy, trajectory=kind), (i + 1,))
        np.testing.assert_array_equal(run.log.tau[i], alone.log.tau[0])
        np.testing.assert_array_equal(run.q[i], alone.q[0])


def test_motions_of_unequal_length_are_refused(short, robot):
    motions = [RandomMoves(moves=1, durations=(T, T), rest=0.1).sample(robot, short.fs) for T in (1.3, 1.4)]
    with pytest.raises(ScenarioError, match="motions of 150 to 160 samples cannot advance together"):
        simulate(short, (1, 2), motions=motions)
