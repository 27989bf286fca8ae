"""Friction as smooth functions of velocity: found where laws miss something, small where nothing is missed."""

import runpy
from dataclasses import replace

import numpy as np
import pytest

import idbench
from idbench.sim import load_scenario, run
from idbench.sim.trajectories import RandomMoves

CURVE = np.array([0.4, 0.08])
"""Size of a Stribeck curve that no standard law has [N m]."""


def log_of(seed, curve):
    rng = np.random.default_rng(seed)
    plain = run(replace(load_scenario("ideal"), trajectory=RandomMoves(seed=seed))).alone()
    qd = np.gradient(plain.q, 1 / plain.fs, axis=0)
    extra = curve * CURVE * np.exp(-((qd / 0.5) ** 2)) * np.sign(qd)
    return replace(plain, tau=plain.tau + extra + [0.02, 0.001] * rng.standard_normal(plain.tau.shape))


@pytest.fixture(scope="module")
def fits():
    logs = log_of(1, 1.0), log_of(2, 1.0)
    return {
        law: idbench.fit(logs[0], "scara", model="explicit", friction=law, validate=logs[1]) for law in ("standard", "smooth")
    }


def test_what_standard_laws_miss_is_found(fits):
    """A Stribeck curve: the held-out error of both joints falls to a third at least."""
    percent = {
        law: np.array(f.summary()["validation"]["models"]["explicit"]["torque_error_percent"]) for law, f in fits.items()
    }
    assert (percent["smooth"] < percent["standard"] / 3).all()


def test_functions_are_small_where_nothing_is_missed():
    """Below a fiftieth of those that a curve needs, and the laws' parameters are what they were."""
    plain = {law: idbench.fit(log_of(1, 0.0), "scara", model="explicit", friction=law) for law in ("standard", "smooth")}
    assert (np.array(plain["smooth"].fit.request.smooth) < 0.02 * CURVE).all()
    for name in ("ZZR1", "ZZ2", "LMX2"):
        one, other = (f.parameters[name] for f in plain.values())
        assert one.value == pytest.approx(other.value, rel=0.02)


def test_they_are_predicted_and_written(fits, tmp_path):
    fit = fits["smooth"]
    fit.write(tmp_path / "arm.py")
    arm, rng = runpy.run_path(str(tmp_path / "arm.py")), np.random.default_rng(0)
    q, qd, qdd = rng.normal(size=(3, 40, 2))
    np.testing.assert_allclose(arm["inverse_dynamics"](q, qd, qdd), fit.predict(q, qd, qdd), rtol=1e-6, atol=1e-6)
    assert "ZZR1" in repr(fit)
    assert "u1_1" not in repr(fit)
    with pytest.warns(UserWarning, match="smooth functions of friction have no place in the file"):
        fit.write(tmp_path / "arm.xml")
