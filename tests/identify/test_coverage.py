"""Is the corrected sigma right? Where the torques have white noise and nothing else is wrong, truths are counted."""

import numpy as np
import pytest

from identify import ESTIMATORS, MODELS, MotionLog, TorqueChannel, identify_each, scara
from sim.engine.ideal_log import ideal_log
from sim.trajectories import RandomMoves, Reference

RUNS, BATCH, FS = 600, 200, 100.0


@pytest.fixture(scope="module")
def logs(robot):
    """600 motions of 17 s, each drawn anew, noise-free."""
    moves = (RandomMoves(moves=12, durations=(1.3, 1.3), rest=0.7, seed=seed) for seed in range(RUNS))
    plans = [move.sample(robot, FS) for move in moves]
    q, qd, qdd = (np.concatenate([getattr(plan, x) for plan in plans]) for x in ("q", "qd", "qdd"))
    tau = ideal_log(robot, Reference(FS, q, qd, qdd)).tau
    return q.reshape(RUNS, -1, 2), tau.reshape(RUNS, -1, 2)


@pytest.mark.parametrize(
    ("sigma", "estimator"),
    [((0.5, 0.025), "OLS"), ((0.025, 0.5), "WLS"), ((0.5, 0.025), "GLS")],
)
def test_two_corrected_sigma_hold_the_truth_in_95_percent(estimator, sigma, logs, truth):
    """For every parameter and model; 95.4 % is right, and 600 runs tell it to 0.9 %. The paper's sigma does not do that."""
    runs = RUNS // 3 if estimator == "GLS" else RUNS  # it takes ten times as long, and 200 runs tell it to 1.5 %
    off = 0.045 if estimator == "GLS" else 0.027  # three times that
    q, tau = (x[:runs] for x in logs)
    noisy = tau + sigma * np.random.default_rng(11).standard_normal(tau.shape)
    models = {name: MODELS.create(name) for name in MODELS.builtin}
    inside, papers = ({name: [] for name in models} for _ in range(2))
    for start in range(0, runs, BATCH):
        log = MotionLog(FS, q[start : start + BATCH], noisy[start : start + BATCH], TorqueChannel("instantaneous"))
        for name, found in identify_each(log, scara(), models, estimator=ESTIMATORS.create(estimator)).items():
            inside[name].append(np.abs(found.X - truth) < 2 * found.corrected_sigma)
            papers[name].append(np.abs(found.X - truth) < 2 * found.sigma)
    for name in models:
        share = np.concatenate(inside[name]).mean(axis=0)
        assert share.min() >= 0.954 - off, (name, share)
        assert share.max() <= 0.954 + off, (name, share)
    if estimator != "GLS":  # whose own sigma is that
        assert min(np.concatenate(found).mean(axis=0).min() for found in papers.values()) < 0.9
