"""The engine: same bits at any batch, thread count and order; what varies between simulations; what it refuses."""

from dataclasses import replace

import numpy as np
import pytest

from sim.controllers import ComputedTorque, PDFeedforward
from sim.drives import AveragedDrive, SwitchedDrive
from sim.encoders import IncrementalEncoder
from sim.engine import simulate
from sim.errors import ScenarioError
from sim.frictions import LuGre, Stribeck
from sim.measurement import TorqueMeasurement
from sim.ripple import Ripple
from sim.scara import scara_truth
from sim.scenario import Timing
from sim.trajectories import Quintic

BUSY = {
    "controller": ComputedTorque(model_error=0.1),
    "timing": Timing(delay=0.0034, jitter=0.001),
    "ripple": Ripple(cogging=1.0, commutation=0.02),
    "encoder": IncrementalEncoder(lines=2000, noise=1e-4, missed_counts=1.0, interpolation_error=0.01),
    "torque": TorqueMeasurement(source="current", noise=0.1, cutoff=200.0),
    "trajectory": Quintic(((0.0, 0.0), (0.6, -0.5), (0.0, 0.2)), (0.4, 0.4), 0.1),
}
"""Everything that is random or remembers something."""


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
    with pytest.raises(ScenarioError, match=r"joint joint\d leaves its range at t = .* s \(seed 0\): the loop is unstable"):
        simulate(wild)


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
