"""Mistakes that are named: logs with one fault each, made by MuJoCo's inverse dynamics, and logs without any."""

import importlib.util
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from idbench.identify import ESTIMATORS, estimate
from idbench.identify.arrays import combined
from idbench.identify.judge.diagnosis import diagnosed, dropped_samples
from idbench.identify.judge.fitted_motion import FittedMotion
from idbench.identify.judge.mistakes import OF_JOINTS, OF_ROBOT
from idbench.identify.judge.stretches import left_unexplained
from idbench.identify.judge.whole_mistakes import DECISIVE, _likely, _others
from idbench.identify.signals.signals import State

spec = importlib.util.spec_from_file_location("faulty_logs", Path(__file__).parent / "faulty_logs.py")
logs = importlib.util.module_from_spec(spec)
spec.loader.exec_module(logs)


def case(robot, kind="", noise=4.0, seed=0, **more):
    return logs.Case(robot, noise, kind, seed, **more)


def null(robot, name, noise, seed):
    return logs.Case(robot, noise, "", seed, unusual=logs.NULLS[name])


LARGE = {
    "wall": {"kind": "tilt", "size": np.pi / 2},
    "ceiling": {"kind": "tilt", "size": np.pi},
    "compensated": {"kind": "compensated"},
    "last sign": {"kind": "sign", "at": 0.99},
    "asymmetry": {"kind": "asymmetry"},
    "rate": {"kind": "rate"},
}
"""Large mistakes, and one of all torques."""


def load_of(motion, j, changes):
    """Return the torque of links and rotors with joint j moved by something, with its derivatives."""
    basis, X = motion.rigid
    q, qd, qdd = (np.array(x) for x in (motion.state.q, motion.state.qd, motion.state.qdd))
    for x, change in zip((q, qd, qdd), changes, strict=True):
        x[j] += change
    return combined(basis.explicit(State(q, qd, lambda _: qdd)), X, np.zeros(q.shape))


@pytest.mark.parametrize(
    "kind", ["", "gain", *(pytest.param(kind, marks=pytest.mark.thorough) for kind in ("load-friction", "sign"))]
)
def test_a_fault_is_named_and_none_where_there_is_none(kind):
    assert case("panda", kind).right()


@pytest.mark.thorough
def test_the_size_of_a_mistake_is_found_within_its_sigma():
    """A zero of the third joint 1 degree off at 4 % noise, within 3 sigma and 3 % for what is not linear."""
    (first, *_) = case("panda", "zero", 0.5, size=np.radians(5)).found()
    assert (first.cause, first.joint) == ("zero", 2)
    assert abs(first.size[0] - np.radians(5)) < 3 * first.sigma[0] + 0.03 * np.radians(5)
    assert ("axis", 3) in first.alternatives  # turns the same link
    assert first.held_out[1] < 0.3 * first.held_out[0]


@pytest.mark.thorough
def test_causes_and_joints_are_named_first_of_what_a_log_can_show():
    """With 4 % of noise, of the faults that leave the log less likely beyond doubt, at least 85 %."""
    cases = [case("panda", kind) for kind in logs.KINDS]
    right = {one.kind: one.right() for one in cases if one.shown() > DECISIVE}
    assert len(right) > 25
    assert np.mean(list(right.values())) >= 0.85, [kind for kind, ok in right.items() if not ok]


@pytest.mark.thorough
@pytest.mark.parametrize("robot", ["scara", "puma560", "panda", "servo_arm"])
def test_logs_without_a_fault_have_none(robot):
    """White and coloured noise, coarse encoders, slow and short motion: at most one of 20."""
    found = [null(robot, name, noise, seed).right() for name in logs.NULLS for noise in (0.5, 4.0) for seed in range(2)]
    assert sum(found) >= len(found) - 1


@pytest.mark.parametrize("mistake", [*OF_JOINTS, *OF_ROBOT], ids=lambda m: f"{m.cause} {m.of}")
def test_columns_have_a_value_at_every_instant(mistake):
    motion = FittedMotion(*case("panda").motion())
    found = mistake.columns(motion, 2)
    for rows in found if isinstance(found, tuple) else (found,):
        assert all(np.isfinite(x).all() and len(x) == len(motion.t) for x in rows.values())


@pytest.mark.parametrize("cause", ["zero", "scale", "delay"])
def test_a_column_is_the_difference_that_a_small_mistake_makes(cause):
    """tau(q + b x) - tau(q), by the fitted model itself, to first order."""
    basis, X, state, t = case("panda").motion()
    motion, j, b = FittedMotion(basis, X, state, t), 2, 1e-5
    x = {"zero": np.ones_like(t), "scale": state.q[j], "delay": -state.qd[j]}[cause]
    xd = {"zero": 0 * t, "scale": state.qd[j], "delay": -state.qdd[j]}[cause]
    xdd = {"zero": 0 * t, "scale": state.qdd[j], "delay": -np.gradient(state.qdd[j], t)}[cause]
    ahead, behind = (load_of(motion, j, (s * b * x, s * b * xd, s * b * xdd)) for s in (1, -1))
    (mistake,) = (m for m in OF_JOINTS if (m.cause, m.of) == (cause, "position"))
    column = np.stack([mistake.columns(motion, j)[k] for k in range(7)])
    np.testing.assert_allclose(column, -(ahead - behind) / (2 * b), atol=2e-3 * np.abs(column).max())


@pytest.mark.thorough
def test_what_a_mistake_explains_is_its_part_of_the_residual():
    """Of a torque constant a fifth too large, nearly all of the joint's residual, and no more."""
    one = case("panda", "gain", 0.5)
    problem = one.problem()
    X = estimate(problem, ESTIMATORS.create("GLS")).X
    first, rows = one.found()[0], problem.rows
    own = (rows.group == first.joint) & rows.valid
    residual = (rows.Y - rows.predicted(X))[own]
    left = residual - first.explained[own]
    assert np.sum(left**2) < 0.5 * np.sum(residual**2)
    assert abs(np.sum(left * first.explained[own])) < 0.2 * np.sum(residual**2)


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("robot", "name", "cause"),
    [
        ("puma560", "wall", "gravity"),
        ("puma560", "ceiling", "gravity"),
        ("puma560", "compensated", "gravity"),
        ("puma560", "last sign", "sign"),
        ("puma560", "asymmetry", "asymmetry"),
        ("panda", "rate", "rate"),
    ],
)
def test_large_mistakes_are_named_on_each_motion(robot, name, cause):
    found = [case(robot, noise=4.0, seed=seed, **LARGE[name]).found() for seed in range(3)]
    assert [each[0].cause if each else None for each in found] == [cause] * 3


@pytest.mark.parametrize(
    "fault",
    [{"kind": "exchanged-torques", "at": 0.7}, *(pytest.param(x, marks=pytest.mark.thorough) for x in (LARGE["wall"], {}))],
)
def test_the_middle_of_a_log_leaves_the_mistake_that_all_of_it_shows(fault):
    """Most are refuted by it; the one that explains most is not."""
    problem = case("puma560", **fault, unusual={"time": 120.0}).problem().explicit
    counts, before = problem.factors.rows, float(problem.factors.misfit())
    every, likely = list(_others(problem)), {each.key for each in _likely(problem)}
    gains = {each.key: before - each.misfit(counts) for each in every}
    best = max(gains, key=lambda key: gains[key])
    assert (gains[best] > DECISIVE) == bool(fault)
    assert best in likely or not fault
    assert len(likely) < len(every) / 2


@pytest.mark.thorough
def test_weights_converge_where_joints_carry_very_different_torques():
    """A servo arm whose torques of one joint are a hundred thousandth: no sign explains what too few rounds leave."""
    problem = case("panda").problem()
    (log,) = problem.logs
    scale = np.array([1, 1, 1, 1, 1, 1, 1e-5])
    tiny = problem.with_logs([replace(log, tau=log.tau * scale)])
    two, many = (float(np.sum(tiny.factors.squares(tiny.factors.fit(k).X))) for k in (4, 12))
    assert abs(two - many) < 1e-4 * many  # of some thousand rows, a twentieth of what likelihood leaves to chance


@pytest.mark.thorough
@pytest.mark.parametrize("late", [0.004, 0.012])
def test_the_size_of_a_lateness_is_that_which_was_made(late):
    """To first order alone 12 ms at 100 Hz are half as much."""
    one = case("panda", noise=0.5)
    (log,) = one.problem().logs
    shown = np.stack([np.interp(log.t - late * (j == 2), log.t, x) for j, x in enumerate(log.tau.T)], axis=1)
    problem = one.problem().with_logs([replace(log, tau=shown)])
    first = diagnosed(problem, estimate(problem, ESTIMATORS.create("GLS")).X)[0]
    assert (first.cause, first.joint) == ("delay", 2)
    assert first.size[0] == pytest.approx(late, rel=0.1)


def test_dropped_samples_are_one_cause_and_a_slip_is_none():
    one = logs.Lab("puma560", 0)
    clean, dropped = one.log(0.5), one.log(0.5, logs.Fault("dropouts", 0.05))
    slipped = one.log(0.5, logs.Fault("zero", 0.3, "joint2", 15.0))
    assert dropped_samples([clean, slipped]) is None
    found = dropped_samples([clean, dropped])
    assert (found.cause, found.joint, found.log) == ("dropouts", None, 1)


@pytest.mark.parametrize("before", [0.8, 1.0, 1.3, 2.5])
def test_a_mend_that_leaves_less_is_never_worse(before):
    """Whatever the noise, 1, is: also where it was taken for too large."""
    after = np.linspace(0.0, before, 200)
    shares = np.array([left_unexplained(np.array([before]), np.array([x]), np.ones(1))[0] for x in after])
    assert (np.diff(shares) >= 0).all()
    assert shares[0] == 0
    assert shares[-1] == 1
