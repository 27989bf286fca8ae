"""What limits standard errors, in words, and the intervals of torques that leave the bench."""

import json
import runpy
from dataclasses import replace

import numpy as np
import pytest

import idbench
from idbench.experiments.errors import ExperimentError
from idbench.experiments.identification.logs import DELAYS
from idbench.experiments.reports.estimates import correlated, words_of_uncertainty
from idbench.identify import MODELS, TorqueChannel, identify, scara
from idbench.sim import load_scenario, run


@pytest.fixture(scope="module")
def log():
    rng = np.random.default_rng(0)
    plain = run(load_scenario("ideal")).alone()
    return replace(plain, tau=plain.tau + [0.2, 0.01] * rng.standard_normal(plain.tau.shape))


@pytest.fixture(scope="module")
def fit(log):
    return idbench.fit(log, "scara", model="explicit")


def test_a_delay_that_is_hardly_known_is_correlated_with_friction(log):
    late = replace(log, torque=TorqueChannel("instantaneous", log.torque.delay, delay_sigma=0.01))
    found = correlated(identify(late, scara(), MODELS.create("explicit")))
    assert ("Fv1", "the delay") in [pair[:2] for pair in found]
    assert not correlated(identify(log, scara(), MODELS.create("explicit")))


def test_logs_that_differ_say_by_how_much(log):
    """Friction of the second log is 30 % more, by its torques."""
    qd = np.gradient(log.q, 1 / log.fs, axis=0)
    more = replace(log, tau=log.tau + 0.3 * (np.array([0.5, 0.1]) * np.sign(qd)))
    found = idbench.fit([log, more], "scara", model="explicit")
    words = " ".join(words_of_uncertainty(found.fit))
    assert "from log to log parameters move" in words
    assert "Fs1" in words
    assert found.summary()["models"]["explicit"]["between_logs"][2] == pytest.approx(0.15 / np.sqrt(2), rel=0.2)


def test_predictions_have_intervals_in_every_form(fit, log, tmp_path):
    q = log.q[:50]
    zero = np.zeros_like(q)
    tau, half = fit.predict(q, zero, zero, interval=0.95)
    assert tau.shape == half.shape == q.shape
    np.testing.assert_array_equal(fit.predict(q, zero, zero), tau)
    fit.write(tmp_path / "arm.py", tmp_path / "arm.json")
    arm = runpy.run_path(str(tmp_path / "arm.py"))
    np.testing.assert_allclose(arm["torque_interval"](q, zero, zero), half, rtol=1e-4)
    assert not arm["outside_fit"](q, zero, zero).all()
    assert arm["outside_fit"](q, zero + 100, zero).all()
    written = json.loads((tmp_path / "arm.json").read_text())["torque_interval"]
    np.testing.assert_allclose(written["half"], half[0], rtol=1e-9)
    summary = fit.summary()
    np.testing.assert_allclose(summary["models"]["explicit"]["torque_interval"], half[0], rtol=1e-9)
    assert 0.85 < np.mean(summary["validation"]["models"]["explicit"]["within_interval"]) <= 1
    with pytest.raises(ExperimentError, match="a share between 0 and 1"):
        fit.predict(q, zero, zero, interval=95.0)


def test_both_parts_of_sigma_are_in_the_summary(fit):
    found = fit.summary()["models"]["explicit"]
    assert (np.array(found["sigma"]) >= np.array(found["sigma_noise"]) * (1 - 1e-12)).all()
    assert len(found["paper_sigma"]) == len(found["sigma"])


def test_a_delay_that_no_range_holds_does_not_end_the_fit(log, monkeypatch):
    """A log whose best delay lies at the end of all that is looked at is fitted without, and that is said."""
    from idbench.identify import RangeError

    def lost(*given, **settings):
        raise RangeError("the torque fits best at an end of the range, 0.6 s")

    monkeypatch.setitem(DELAYS, "estimate", lost)
    found = idbench.fit(replace(log, torque=TorqueChannel("held")), "scara", model="explicit", torque_delay="estimate")
    assert any("torque delay not found: the torque fits best at an end" in note for note in found.fit.logs.notes)
    assert np.isfinite(found.parameters["ZZR1"].value)
