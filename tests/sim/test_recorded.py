"""Motions out of files: planned ones as they were, measured ones without their noise."""

import re

import numpy as np
import pytest

from idbench.sim.errors import ScenarioError
from idbench.sim.trajectories import Quintic, Recorded

PLANNED = Quintic(waypoints=((0.0, 0.0), (0.8, -0.6), (0.1, 0.5)), durations=(1.0, 1.2), rest=0.5).points


def written(path, t, q, names="t,q1,q2,current"):
    rows = np.column_stack([t, q, np.ones(len(t))])
    path.write_text("\n".join([names, *(",".join(f"{x:.12g}" for x in row) for row in rows)]))
    return str(path)


@pytest.fixture
def planned(tmp_path):
    """A file at 100 Hz."""
    t = np.arange(0, PLANNED.duration + 1e-9, 0.01)
    return written(tmp_path / "planned.csv", t, PLANNED.at(t, 100.0).q)


def test_a_planned_motion_is_that_of_its_file_between_its_samples(planned, robot):
    """To what a spline makes of the jumps of jerk at the moves' ends: a tenth of a per cent of the acceleration."""
    motion = Recorded(file=planned).plan(robot)
    assert motion.duration == pytest.approx(PLANNED.duration + 0.01)
    t = np.arange(0.003, PLANNED.duration, 0.01)
    found, true = motion.at(t, 100.0), PLANNED.at(t, 100.0)
    np.testing.assert_allclose(found.q, true.q, atol=1e-6)
    np.testing.assert_allclose(found.qd, true.qd, atol=2e-4)
    assert np.std(found.qdd - true.qdd) < 2e-3 * np.std(true.qdd)
    for end in (motion.at(np.zeros(1), 1.0), motion.at(np.array([1e3]), 1.0)):
        np.testing.assert_allclose([end.qd, end.qdd], 0.0, atol=1e-9)


def test_measured_positions_leave_their_noise_in_the_file(tmp_path, robot, rng):
    t = np.arange(0, PLANNED.duration, 0.01) + rng.uniform(0, 0.002, round(PLANNED.duration / 0.01))
    q = PLANNED.at(t, 100.0).q + 1e-4 * rng.standard_normal((len(t), 2))
    file = written(tmp_path / "measured.csv", t, q)
    with pytest.raises(ScenarioError, match=r"or give trajectory\.cutoff if its positions were measured"):
        Recorded(file=file).plan(robot)
    motion, inner = Recorded(file=file, cutoff=8.0).plan(robot), np.arange(0.1, 3.0, 0.01)
    true = PLANNED.at(inner + t[0], 100.0)
    assert np.std(motion.at(inner, 100.0).qdd - true.qdd) < 0.1 * np.std(true.qdd)


@pytest.mark.parametrize(
    ("rows", "options", "message"),
    [
        ("", {}, "has no column t, q1, q2; its columns are "),
        ("t,q1,qd1\n0,0,0", {}, "has no column q2; its columns are t, q1, qd1"),
        ("t,q1,q2\n0,0,0\n0.1,0,0", {}, "has too few instants: a motion needs at least 6"),
        ("t,q1,q2\n\n\n", {}, "has too few instants"),
        ("t,q1,q2\n0,0,0\n\n\n\n\n\n\n1,0,0\n2,0,0", {}, "has too few instants"),
        ("t,q1,q2\n" + "0,0,0\n" * 9, {}, "instants that do not rise"),
        (
            "t,q1,q2\n" + "".join(f"{k},0,0\n" for k in range(15)),
            {"cutoff": 0.2},
            "with trajectory.cutoff it needs at least 16",
        ),
        ("t,q1,q2\n" + "".join(f"{k},nan,0\n" for k in range(9)), {}, "numbers that are not finite"),
        ("t,q1,q2\n" + "".join(f"{k},x,0\n" for k in range(9)), {}, "cannot read the motion"),
        ("t,q1,q2\n" + "".join(f"{k},{k},0\n" for k in range(9)), {}, "begins while joint1 moves at 100 % of the top speed"),
        ("t,q1,q2\n" + "".join(f"{k},0,0\n" for k in range(9)), {"cutoff": 0.6}, "must be below 0.5 Hz, half the rate"),
    ],
)
def test_files_that_are_no_motion_are_told(rows, options, message, tmp_path, robot):
    (tmp_path / "motion.csv").write_text(rows)
    with pytest.raises(ScenarioError, match=re.escape(message)):
        Recorded(file=str(tmp_path / "motion.csv"), **options).plan(robot)


def test_a_file_is_found_from_any_folder(planned, robot, tmp_path, monkeypatch):
    """A joint that is held, names in quotation marks, the mark of a file's encoding, and a blank line are no trouble."""
    monkeypatch.chdir(tmp_path)
    t = np.arange(0, PLANNED.duration, 0.01)
    q = PLANNED.at(t, 100.0).q * [1, 0] + [0, 0.3]
    written(tmp_path / "held.csv", t, q + 1e-6 * np.sin(40 * t)[:, None], '\ufeff"t","q1","q2","current"\n')
    held = Recorded(file="held.csv")
    monkeypatch.chdir("/")
    assert np.abs(held.plan(robot).at(t, 100.0).q - q).max() < 1e-5
