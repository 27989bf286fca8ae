"""Contracts of the plug-in points of a scenario."""

from typing import Any

import numpy as np

from idbench.experiments.contracts.contract import FS, RUNS, Example, require, require_equal
from idbench.sim.controllers import Task
from idbench.sim.engine.failures import Bounds
from idbench.sim.engine.plant import Plant
from idbench.sim.robot.robot import Robot
from idbench.sim.scenario.scenario import Physics

COUNT = 2 * np.pi / 2**16  # Step of the encoders by default [rad]
STEP = 1e-3  # Physics step [s]


def controller_commands_every_simulation_by_itself(controller: Any, example: Example) -> None:
    """It commands every simulation by itself, shape (simulation, joint), to the bit."""
    reference = example.reference
    law, alone = (controller.start(Task(example.robot, reference, nsim)) for nsim in (RUNS, 1))
    for k in range(5):
        q = reference.q[k] + np.array([[0.0, 0.0], [0.01, -0.02], [0.02, 0.01]])
        u = np.asarray(law.command(k, q))
        require(u.shape == (RUNS, 2), f"commands have the shape {u.shape}, expected {(RUNS, 2)}")
        require_equal(alone.command(k, q[1:2]), u[1:2], "the command of a simulation in a batch")


def drive_gives_finite_torques(drive: Any, example: Example) -> None:
    """It gives a finite torque for every step, and a lag that is not negative."""
    h = drive.step_length(FS, STEP)
    require(0 < h <= STEP + 1e-12, f"its step of {h:g} s is not between 0 and {STEP:g} s")
    amplifier = drive.start(example.robot, RUNS, h)
    for steps in (1, 1) if drive.steady else (1, 4):
        tau = np.asarray(amplifier.step(np.full((RUNS, 2), 2.0), np.zeros((1 if drive.steady else steps, RUNS, 2)), steps))
        shapes = {(1, RUNS, 2), (steps, RUNS, 2)}
        require(tau.shape in shapes, f"torques of {steps} steps have the shape {tau.shape}, expected one of {sorted(shapes)}")
        require(np.isfinite(tau).all(), "a torque is not finite")
    require((np.asarray(drive.lag(example.robot)) >= 0).all(), "its lag is negative")


def encoder_reads_to_a_count(encoder: Any, _: Example) -> None:
    """It reads standing joints to a step of a 16-bit encoder."""
    reader = encoder.start(2, 10, FS, [np.random.default_rng(i) for i in range(RUNS)])
    for k in range(10):
        q = np.full((RUNS, 2), 0.1 * k)
        require_equal(reader.read(k, q), q, "a measured position", atol=COUNT)


def friction_resists(law: Any, example: Example) -> None:
    """What it adds to MuJoCo's own friction opposes the motion."""
    bounds = Bounds(example.robot, example.reference, 1)
    plant, qd = Plant([example.robot.model], Physics(), STEP, bounds), np.array([[1.0, -1.0]])
    contact = law.start(plant, np.array([[0.5, 0.1]]), STEP)
    for _ in range(50):
        torque = np.asarray(contact.torque(qd))
    require((torque * qd <= 0).all(), f"at velocities of {qd[0]} rad/s it drives with {torque.ravel()} N m")


def excitation_leads_back_to_rest(excitation: Any, _: Example) -> None:
    """Its shapes rest where they begin and end, at the same place, and their derivatives are those of their positions."""
    T, f = 8.0, 1.0
    ends = excitation.shapes(np.array([0.0, T * (1 - 1e-9)]), T, f).values
    require_equal(ends[1:3], 0.0, "a velocity or acceleration at an end", atol=1e-5)
    require_equal(ends[0, 1], ends[0, 0], "a position at the end", atol=1e-5)
    t, h = np.linspace(0.1, T - 0.1, 50), 1e-5
    before, here, after = (excitation.shapes(t + step, T, f).values for step in (-h, 0.0, h))
    for order, what in ((0, "a velocity"), (1, "an acceleration")):
        require_equal(here[order + 1], (after[order] - before[order]) / (2 * h), what, atol=1e-3)


def excitation_becomes_its_trajectory(excitation: Any, _: Example) -> None:
    """The trajectory of coefficients moves along the sum of their shapes, after its rest."""
    T, f = 8.0, 1.0
    t, robot = np.arange(0.25, T, 0.5), Robot.load("scara")
    shapes = excitation.shapes(t, T, f)
    c = 0.1 * np.random.default_rng(0).standard_normal((shapes.count, 2))
    planned = excitation.trajectory(c, np.array([0.1, -0.2]), T, 1).motion(robot)
    rest = (planned.duration - T) / 2
    require(rest >= 0, f"it lasts {planned.duration:g} s, less than the {T:g} s that it was given")
    require_equal(planned.at(rest + t, FS).q, shapes.at(c)[0] + [0.1, -0.2], "a position", atol=1e-9)


def trajectory_rests_at_both_ends(trajectory: Any, example: Example) -> None:
    """It moves the joints of the robot, inside their ranges, and begins and ends at rest."""
    reference = trajectory.sample(example.robot, FS)
    require(reference.q.shape[1] == example.robot.n, f"it moves {reference.q.shape[1]} joints of {example.robot.n}")
    require_equal(reference.qd[[0, -1]], 0.0, "the velocity at an end", atol=1e-9)
