"""Ripples of a joint's torque: within the band of the rows, and above it."""

import numpy as np
import pytest

import idbench
from idbench.identify import MotionLog, TorqueChannel
from idbench.identify.judge.ripples import fast_ripples
from idbench.sim import load_scenario, run

ROTOR = """<mujoco><worldbody><body><joint name="shaft" axis="0 0 1"/><inertial pos="0 0 0" mass=".1"
  diaginertia="1e-4 1e-4 1e-4"/></body></worldbody></mujoco>"""

FS, IA, FV, FS1, NOISE = 250.0, 1e-4, 2e-3, 0.02, 2e-3


@pytest.fixture(scope="module")
def rotor(tmp_path_factory):
    path = tmp_path_factory.mktemp("rotor") / "rotor.xml"
    path.write_text(ROTOR)
    return str(path)


def log_of(ripple, seed=0, seconds=40.0):
    """A rotor that turns at 1.4 to 1.8 rad/s, the other way every 5 s: I qdd + Fv qd + Fs sign(qd) + ripple(q) + noise."""
    rng, t = np.random.default_rng(seed), np.arange(0, seconds, 1 / FS)
    speed = 1.6 + 0.2 * np.sin(2 * np.pi * 0.23 * t)
    turn = np.tanh(np.sin(2 * np.pi * t / 10) / 0.02)
    qd = speed * turn
    q = np.cumsum(qd) / FS
    tau = IA * np.gradient(qd, 1 / FS) + FV * qd + FS1 * np.sign(qd) + ripple(q) + NOISE * rng.standard_normal(len(t))
    return MotionLog(FS, q[:, None], tau[:, None], TorqueChannel("instantaneous"))


def ripples(fit):
    return [cause.suspect for cause in fit.diagnosis if cause.suspect.cause in ("cogging", "commutation")]


def test_a_ripple_above_the_band_of_the_rows_is_named_with_its_size_and_what_lets_rows_have_it(rotor):
    """42 waves at 1.6 rad/s are 10.7 Hz, rows end at 5."""
    fit = idbench.fit(log_of(lambda q: 0.03 * np.sin(42 * q + 0.4)), rotor, armature="none").fit
    (found,) = ripples(fit)
    assert (found.joint, found.setting) == (0, 42.0)
    assert found.size[0] == pytest.approx(0.03, abs=4 * found.sigma[0] + 3e-4)  # q' is differentiated: 1 %
    (cause,) = (each for each in fit.diagnosis if each.suspect is found)
    assert cause.remedy == "--friction standard+cogging:42 --cutoff 16"  # 1.25 times 42 waves at 1.8 rad/s


def test_what_it_says_next_is_right(rotor):
    log = log_of(lambda q: 0.012 * np.sin(12 * q) + 0.03 * np.cos(42 * q))
    fit = idbench.fit(log, rotor, armature="none", friction=("standard+cogging:12+cogging:42",), cutoff=16.0).fit
    assert not ripples(fit)
    X, sigma = fit.estimates[fit.leading].X, fit.estimates[fit.leading].standard_errors
    truth = {"Fs1": FS1, "C12s1": 0.012, "C12c1": 0.0, "C42s1": 0.0, "C42c1": 0.03}
    for name, true in truth.items():
        k = fit.basis.names.index(name)
        assert X[k] == pytest.approx(true, abs=4 * sigma[k] + 2e-4), name


@pytest.mark.parametrize("seed", range(3))
def test_noise_has_none(rotor, seed):
    assert not ripples(idbench.fit(log_of(np.zeros_like, seed), rotor, armature="none").fit)


def test_a_ripple_that_takes_little_of_what_is_left_is_not_named(rotor):
    """Beside a chirp of 2 to 40 Hz that the model has not: 5 % of its squares."""
    log = log_of(lambda q: 0.004 * np.sin(42 * q))
    t = np.arange(log.samples) / FS
    chirp = 0.03 * np.sin(2 * np.pi * (2 * t + 38 / 80 * t**2))
    assert not ripples(idbench.fit(MotionLog(FS, log.q, log.tau + chirp[:, None], log.torque), rotor, armature="none").fit)


@pytest.mark.thorough
def test_friction_auto_finds_the_cogging_that_a_scenario_has():
    done = run(load_scenario("ripple"))
    fit = idbench.fit(done.alone(), "scara", friction=("auto",)).fit
    X, sigma = fit.estimates[fit.leading].X, fit.estimates[fit.leading].standard_errors
    for name in ("C36s1", "C36c1", "C28s2", "C28c2"):
        k = fit.basis.names.index(name)
        assert X[k] == pytest.approx(done.truth[name], abs=4 * sigma[k]), name


def test_a_log_that_is_too_slow_for_a_wave_does_not_bias_its_size(rotor):
    """42 waves are above the band in the first of three logs alone."""
    fast, slow = log_of(lambda q: 0.03 * np.sin(42 * q)), log_of(lambda q: 0.03 * np.sin(42 * q), seed=1)
    logs = [fast, *(MotionLog(FS, slow.q / 4, 0.01 * np.sign(slow.q - 1) + 0 * slow.tau, slow.torque) for _ in range(2))]
    problem = idbench.fit([fast], rotor, armature="none").fit.problem
    several = problem.with_logs(logs)
    (found,) = fast_ripples(several, problem.factors.fit(2).X, 1e-6, 0.9)
    assert found.setting == 42.0
    assert found.size[0] == pytest.approx(0.03, rel=0.02)


def test_half_of_what_is_left_beyond_noise_is_asked_also_of_fast_ripples(rotor):
    """80 waves of 0.01 N m are 20 Hz; two hums that no wave explains have three times their squares."""
    log = log_of(lambda q: 0.01 * np.sin(80 * q))
    t = np.arange(log.samples) / FS
    hum = 0.012 * np.sin(2 * np.pi * 9.3 * t) + 0.012 * np.sin(2 * np.pi * 13.1 * t + 1)
    fit = idbench.fit(MotionLog(FS, log.q, log.tau + hum[:, None], log.torque), rotor, armature="none").fit
    assert not ripples(fit)
