"""One notion of a row that counts: what it does not determine is left out or refused, and no estimate is NaN."""

import importlib.util
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from builders import noisy

from idbench.identify import (
    ESTIMATORS,
    ExplicitModel,
    IdentificationError,
    MotionLog,
    Problem,
    ReversalMask,
    TorqueChannel,
    idbench_chain,
    identify,
    scara,
)
from idbench.identify.judge.delay import estimate_delay
from idbench.identify.judge.torque_interval import torque_interval
from idbench.identify.judge.used_rows import suited_reach
from idbench.identify.rows.operators import Samples

spec = importlib.util.spec_from_file_location("faulty_logs", Path(__file__).parent / "faulty_logs.py")
assert spec is not None
assert spec.loader is not None
logs = sys.modules.setdefault("faulty_logs", importlib.util.module_from_spec(spec))
spec.loader.exec_module(logs)

ALONE = [name for name in ESTIMATORS.builtin if not {"loop", "plant"} & ESTIMATORS.create(name).needs]


def at_rest(log):
    q = log.q.copy()
    q[:, 1] = 0.3
    return [replace(log, q=q)], idbench_chain()


def all_masked(log):
    return [log], replace(idbench_chain(), mask=ReversalMask((0.1, 100.0)))


def edges_alone(log):
    """Of joint 2 the edges of some stretches are left."""
    fastest = float(np.abs(np.gradient(log.q[:, 1], 1 / log.fs)).max())
    return [log], replace(idbench_chain(), mask=ReversalMask((0.1, 0.99 * fastest), 0.03, 0.1))


def duplicates(log):
    return [log, log], idbench_chain()


def one_too_few(log):
    chain = idbench_chain()
    samples = 2 * int(np.ceil(chain.margin(log) * log.fs - 1e-9)) + chain.operator.step(log.fs) - 1
    return [log.part(500, 500 + samples)], chain


CASES = [
    pytest.param(name, case, marks=[pytest.mark.thorough] if (name, case) == ("UKF", duplicates) else [])  # which takes 20 s
    for name in ALONE
    for case in (at_rest, all_masked, edges_alone, duplicates, one_too_few)
]


@pytest.mark.parametrize(("name", "case"), CASES)
def test_no_estimate_is_nan(name, case, log):
    """Of a noise-free log: an estimate is finite, with finite standard errors, or it is refused by name."""
    given, chain = case(log)
    try:
        found = identify(given, scara(), ExplicitModel(), chain, ESTIMATORS.create(name))
    except IdentificationError as error:
        outcome = str(error)
    else:
        outcome = "finite" if np.isfinite([found.X, found.standard_errors]).all() else "NaN"
    assert "NaN" not in outcome


def test_rank_is_judged_on_the_rows_that_are_solved(log):
    """Rows of the edge of a mask alone count for neither."""
    rows = Problem((log,), scara(), ExplicitModel(), edges_alone(log)[1])
    (part,) = rows.parts
    np.testing.assert_array_equal(part.noisy.kept, part.rows.valid)


def slow_arm(seed, noise=4.8e-4):
    """A log of a slow seven-joint arm whose positions jitter; joint 3 hardly moves."""
    lab = logs.Lab("panda", seed, speed=0.5)
    size = np.array([0.5, 0.5, 0.1, 0.5, 0.5, 0.5, 0.5])
    q, qd, qdd = lab.true
    middle = q.mean(axis=0)
    lab.true = middle + size * (q - middle), size * qd, size * qdd
    tau = lab.tau + 0.02 * np.sqrt(np.mean(lab.tau**2, axis=0)) * lab.rng.standard_normal(q.shape)
    q = lab.true[0] + noise * lab.rng.standard_normal(q.shape)
    return MotionLog(logs.FS, q, tau, TorqueChannel("instantaneous")), lab.basis


def test_a_slow_joint_with_noisy_positions_keeps_its_rows():
    """Velocities have noise of 0.05 rad/s, as large as they are themselves: masks found from them would leave nothing."""
    log, basis = slow_arm(0)
    problem = Problem((log,), basis, ExplicitModel(), idbench_chain())
    rows = problem.rows
    assert rows.by_kind(rows.valid).mean(axis=1).min() > 0.4
    found = ESTIMATORS.create("GLS").fit(problem)
    assert np.isfinite(found.standard_errors).all()


@pytest.mark.thorough
@pytest.mark.parametrize("late", [0.00016, 0.0033])
@pytest.mark.parametrize("seed", [1, 2])
def test_a_delay_is_found_to_60_microseconds(seed, late):
    """A six-joint arm with counts of 17 bits and 0.3 % of torque noise, whose torques are logged late."""
    lab = logs.Lab("puma560", seed)
    found = estimate_delay(lab.log(0.3, logs.Fault("delay", late)), lab.basis)
    assert abs(found.delay + late) < 6e-5
    assert abs(found.delay + late) < 3 * found.doubt


def problem_of(log):
    return Problem((log,), scara(), ExplicitModel(), idbench_chain())


def stiction(log, size, rng):
    """Return a log whose joint 2 sticks: of another size after each reversal, in multiples of its Coulomb friction."""
    qd = np.gradient(log.q[:, 1], 1 / log.fs)
    after = np.cumsum(np.diff(np.sign(qd), prepend=0) != 0)
    tau = log.tau.copy()
    tau[:, 1] += 0.1 * size * rng.standard_normal(after.max() + 1)[after] * (np.abs(qd) < 0.15 * np.sqrt(np.mean(qd**2)))
    return replace(log, tau=tau)


def test_stiction_gets_a_wide_mask_and_coulomb_friction_does_not(log, rng):
    plain = noisy(log, 0, [0.05, 0.01], rng=rng)
    assert suited_reach(problem_of(plain)) == ()
    assert suited_reach(problem_of(stiction(plain, 20.0, rng)))[1] > 0


def test_of_a_log_whose_rows_are_not_kept_the_beginning_decides(log, rng, monkeypatch):
    """And nothing of the size of all its rows is made."""
    sticky = stiction(noisy(log, 0, [0.05, 0.01], rng=rng), 20.0, rng)
    monkeypatch.setattr("idbench.identify.rows.rows.LONG", 0.75 * log.samples * log.n**2)
    long, beginning = problem_of(sticky), problem_of(sticky.part(0, int(0.75 * log.samples)))
    assert long.long
    assert suited_reach(long) == suited_reach(beginning)


def test_a_log_too_short_for_10_hz_keeps_its_fit(log):
    """Its chain has a shorter memory than rows of 10 Hz: no interval, and no choice of masks, but an estimate."""
    chain = replace(idbench_chain(), operator=Samples())
    short = log.part(500, 560)
    found = identify(short, scara(), ExplicitModel(), chain)
    assert np.isfinite(found.X).all()
    assert torque_interval(found) is None
    assert suited_reach(found.problem) == ()
