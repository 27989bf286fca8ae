"""Is the corrected sigma right? Where the torques have white noise and nothing else is wrong, truths are counted."""

import numpy as np
import pytest
from builders import SOLVED

from idbench.identify import ESTIMATORS, MODELS, MotionLog, TorqueChannel, identify_each, scara
from idbench.sim.engine.run import ideal_log
from idbench.sim.trajectories import RandomMoves, Reference

RUNS, BATCH, FS = 1500, 250, 100.0


@pytest.fixture(scope="module")
def logs(robot):
    """1500 motions of 17 s, each drawn anew, noise-free."""
    moves = (RandomMoves(moves=12, durations=(1.3, 1.3), rest=0.7, seed=seed) for seed in range(RUNS))
    plans = [move.sample(robot, FS) for move in moves]
    q, qd, qdd = (np.concatenate([getattr(plan, x) for plan in plans]) for x in ("q", "qd", "qdd"))
    tau = ideal_log(robot, Reference(FS, q, qd, qdd)).tau
    return q.reshape(RUNS, -1, 2), tau.reshape(RUNS, -1, 2)


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("sigma", "estimator"),
    [((0.5, 0.025), "OLS"), ((0.5, 0.025), "WLS"), ((0.025, 0.5), "WLS"), ((0.5, 0.025), "GLS")],
)
def test_two_corrected_sigma_hold_the_truth_in_93_to_97_percent(estimator, sigma, logs, truth):
    """For every parameter and model; 95.4 % is right, and 1500 runs tell it to 0.5 %.

    The paper's sigma is off by a factor, either way. With the jackknife, if that is larger, it holds up to 3 % more.
    """
    q, tau = logs
    noisy = tau + sigma * np.random.default_rng(11).standard_normal(tau.shape)
    models = {name: MODELS.create(name) for name in SOLVED}
    inside, papers, whole = ({name: [] for name in models} for _ in range(3))
    for start in range(0, RUNS, BATCH):
        log = MotionLog(FS, q[start : start + BATCH], noisy[start : start + BATCH], TorqueChannel("instantaneous"))
        for name, found in identify_each(log, scara(), models, estimator=ESTIMATORS.create(estimator)).items():
            inside[name].append(np.abs(found.X - truth) < 2 * found.calibrated_sigma)
            papers[name].append(np.abs(found.X - truth) < 2 * found.own_sigma)
            whole[name].append(np.abs(found.X - truth) < 2 * found.standard_errors)
    for name in models:
        share = np.concatenate(inside[name]).mean(axis=0)
        assert share.min() >= 0.93, (name, share)
        assert share.max() <= 0.97, (name, share)
        assert 0.93 <= np.concatenate(whole[name]).mean() <= 0.985, name
    if estimator != "GLS":  # whose own sigma is that
        share = np.array([np.concatenate(found).mean(axis=0) for found in papers.values()])
        assert share.min() < 0.92
        assert estimator != "OLS" or share.max() > 0.999  # that of more than twice its size
