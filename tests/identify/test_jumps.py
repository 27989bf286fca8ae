"""Steps of encoders, found in their counts, and velocities of tachometers beside positions."""

import numpy as np
import pytest

from idbench.identify import encoder_steps
from idbench.identify.data.jumps import Velocities, dropouts, jumps

T = np.arange(2000) / 100.0
MOTION = np.stack([np.sin(T) + 0.1 * T, 0.3 * np.cos(2 * T)], axis=-1)


@pytest.mark.parametrize("steps", [(2 * np.pi / 2**16, 2 * np.pi / 2**12), (1e-5, 2 * np.pi / 10000)])
@pytest.mark.parametrize("digits", [8, 17])
def test_steps_are_found_in_rounded_files(steps, digits):
    """To a thousandth: positions counted about any zero, written with so many significant digits."""
    counted = np.round(MOTION / steps) * steps + [0.1, -0.7]
    written = np.vectorize(lambda x: float(f"{x:.{digits}g}"))(counted)
    np.testing.assert_allclose(encoder_steps(written), steps, rtol=1e-3)


def test_a_fast_joint_that_never_moves_one_step_has_one_all_the_same():
    """Differences of 3, 5, 7 ... steps: their greatest common part."""
    counts = np.cumsum(np.random.default_rng(0).choice([3, 5, 7, 11], 500)) * 1e-3
    assert encoder_steps(counts[:, None])[0] == pytest.approx(1e-3, rel=1e-6)


def test_positions_without_steps_have_none(rng):
    noisy = MOTION + 1e-5 * rng.standard_normal(MOTION.shape)
    still = np.zeros((100, 1))
    assert np.isnan(encoder_steps(noisy)).all()
    assert np.isnan(encoder_steps(still)).all()


def test_one_small_difference_is_no_encoder():
    moved = np.append(np.random.default_rng(0).uniform(0.8e-3, 1.2e-3, 400), 1e-7)
    assert np.isnan(encoder_steps(np.cumsum(moved)[:, None])).all()


FAST = np.arange(0, 8, 1e-3)
TRUE = np.stack([np.sin(1.3 * FAST) + 0.5 * np.sin(3 * FAST), np.cos(2 * FAST)], axis=1)
SPEED = np.stack([1.3 * np.cos(1.3 * FAST) + 1.5 * np.cos(3 * FAST), -2 * np.sin(2 * FAST)], axis=1)


def test_a_gap_of_all_joints_is_one_dropout_and_wild_samples_are_none():
    t = np.arange(1000) / 100
    q = np.sin(np.outer(t, [1.0, 1.3, 0.7, 1.7, 0.9, 1.1]))
    gap = np.concatenate([q[:400], q[440:]])
    wild = q.copy()
    wild[100::150, 0] += 1.0
    assert dropouts(jumps(gap, 100.0)) == 1
    assert len(jumps(wild, 100.0)) >= 5
    assert dropouts(jumps(wild, 100.0)) == 0


def test_velocities_that_know_better_are_used(rng):
    """A 12-bit encoder beside a tachometer: errors fall below a fifth; both noises alone are an order larger."""
    step = 2 * np.pi / 4096
    q, qd = np.round(TRUE / step) * step, SPEED + 1e-3 * rng.normal(size=TRUE.shape)
    found = Velocities.of(q, qd, 1000.0)
    assert found.used.all()
    inner = slice(500, -500)
    better = np.std((found.improved(q, qd) - TRUE)[inner], axis=0)
    assert (better < 0.2 * np.std((q - TRUE)[inner], axis=0)).all()


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        (lambda qd: 57.3 * qd, "57.3 times the differences"),
        (lambda qd: np.roll(qd, 6, axis=0), "6 ms late: not used"),
    ],
    ids=["degrees", "late"],
)
def test_velocities_that_are_not_those_of_the_positions(wrong, message, rng):
    found = Velocities.of(TRUE + 1e-6 * rng.normal(size=TRUE.shape), wrong(SPEED), 1000.0)
    assert not found.used.any()
    assert message in " ".join(found.words(("a", "b")))
