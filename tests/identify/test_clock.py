"""Clocks that need repair: each trouble is put in, found, told, and worth its repair."""

import numpy as np
import pytest

from idbench.identify import LogError, TorqueChannel
from idbench.identify.data.clock import LogClock
from idbench.identify.data.log_columns import LogColumns
from idbench.identify.data.resample import Repaired

FS = 1000.0
T = np.arange(0, 8, 1 / FS)


def motion(t):
    return np.stack([np.sin(1.3 * t) + 0.5 * np.sin(3 * t), np.cos(2 * t)], axis=1)


@pytest.fixture
def columns(rng):
    return LogColumns(T, motion(T) + 1e-6 * rng.normal(size=(len(T), 2)), rng.normal(size=(len(T), 2)), None)


def taken(columns, rows, t=None):
    return LogColumns(columns.t[rows] if t is None else t, columns.q[rows], columns.tau[rows], None)


def off(repaired):
    """Largest error of the positions at the times of the repaired log, away from its ends."""
    log = repaired.logs[0]
    error = log.q - motion(log.t + repaired.clock.t[0])
    return np.abs(error[20:-20]).max()


def repair(columns):
    return Repaired.of(columns, TorqueChannel("instantaneous"))


def test_a_sound_clock_is_left_alone(columns):
    found = repair(columns)
    np.testing.assert_array_equal(found.logs[0].q, columns.q)
    assert list(found.words(("a", "b"))) == []


def test_rows_that_repeat_others_are_left_out(columns, rng):
    """A recorder that missed 6 % of the packets and wrote the last one again: positions would stand and jump."""
    seen = np.maximum.accumulate(np.where(rng.uniform(size=len(T)) > 0.06, np.arange(len(T)), 0))
    broken = taken(columns, seen, T)
    found = repair(broken)
    assert found.clock.word == "stamps"
    assert found.clock.repeated == np.count_nonzero(np.diff(seen) == 0)
    assert off(found) < 2e-5  # several samples in a row, bridged by a cubic
    assert np.abs(broken.q - motion(T)).max() > 1e-3
    assert "repeat the row before while the robot moves" in next(found.words(("a", "b")))


def test_rows_of_a_robot_that_stands_are_no_repeats():
    t = np.arange(0, 4, 1 / FS)
    q = motion(np.clip(t, 1, 3))
    clock = LogClock.of(LogColumns(t, q, 10 * q, None))
    assert clock.repeated == 0


def test_a_recorder_that_is_faster_than_what_it_records(columns, rng):
    """Rows written twice do not mean that a sample was lost: the rows are even, the stamps are not."""
    twice = np.sort(np.concatenate([np.arange(len(T)), rng.choice(len(T), 500, replace=False)]))
    found = repair(taken(columns, twice, np.linspace(0, T[-1], len(twice))))
    assert found.clock.word in ("rows", "steady")
    assert found.logs[0].fs == pytest.approx(FS, rel=1e-3)
    assert off(found) < 2e-5


@pytest.mark.parametrize("jitter", [0.05, 0.15])
@pytest.mark.parametrize("dropped", [0.0, 0.05])
def test_jittered_stamps_of_a_steady_clock(columns, rng, jitter, dropped):
    """Stamps by a busy computer: the samples were even, and some never arrived."""
    rows = np.flatnonzero(rng.uniform(size=len(T)) >= dropped)
    stamps = T[rows] + jitter / FS * rng.normal(size=len(rows))
    found = repair(taken(columns, rows, stamps))
    assert found.clock.word == "steady"
    assert found.clock.jitter == pytest.approx(jitter / FS, rel=0.1)
    assert off(found) < 3e-5  # the clock itself is known to jitter / sqrt(rows)
    assert np.abs(columns.q[rows] - motion(stamps)).max() > 1e-4


def test_uneven_stamps_that_are_right_are_believed(rng):
    t = np.cumsum(rng.uniform(0.5e-3, 1.5e-3, 6000))
    found = repair(LogColumns(t, motion(t), motion(t), None))
    assert found.clock.word == "stamps"
    assert off(found) < 1e-6


def test_a_log_is_cut_where_nothing_was_logged(columns):
    found = repair(taken(columns, (T < 3) | (T > 3.5)))
    assert [log.samples for log in found.logs] == [3000, 4499]
    assert found.clock.gaps == [pytest.approx((2.999, 0.502))]
    assert any("the log is cut there" in words for words in found.words(("a", "b")))


def test_rows_without_values_and_times_that_go_back(columns):
    q = columns.q.copy()
    q[100:103] = np.nan
    t = columns.t.copy()
    t[500] = t[400]
    found = repair(LogColumns(t, q, columns.tau, None))
    assert (found.clock.broken, found.clock.backward) == (3, 1)
    assert off(found) < 2e-5


def test_what_is_no_clock_is_refused(columns):
    with pytest.raises(LogError, match="time hardly ever increases"):
        repair(LogColumns(T[::-1], columns.q, columns.tau, None))
    with pytest.raises(LogError, match="too few"):
        repair(taken(columns, slice(0, 10)))


def test_torques_with_times_of_their_own(columns):
    late = T[::4] + 0.0013
    found = repair(LogColumns(T, columns.q, motion(late), None, t_tau=late))
    log = found.logs[0]
    np.testing.assert_allclose(log.tau, motion(late[0] + log.t), atol=2e-5)  # straight lines between 4 ms
    np.testing.assert_allclose(log.q, motion(late[0] + log.t), atol=1e-5)


def test_gaps_and_missing_values_of_torques_with_times_of_their_own(columns):
    late = T[::4] + 0.0013
    kept = (late < 3) | (late > 5)
    tau = motion(late[kept])
    tau[7] = np.nan
    found = repair(LogColumns(T, columns.q, tau, None, t_tau=late[kept]))
    assert [log.samples for log in found.logs] == pytest.approx([2999, 2996], abs=8)
    assert "torques have 1 gaps of their own" in " ".join(found.words(("a", "b")))
    with pytest.raises(LogError, match="do not overlap"):
        repair(LogColumns(T, columns.q, motion(late), None, t_tau=late + 100))


def test_coarse_positions_alone_are_no_repeats():
    """Torques have times of their own: positions of a 12-bit encoder stand for many samples while the robot moves."""
    step, late = 2 * np.pi / 4096, T + 1e-4
    found = repair(LogColumns(T, np.round(0.1 * motion(T) / step) * step, motion(late), None, t_tau=late))
    assert found.clock.repeated == 0
