"""Frequencies in multiples of wdyn, of scenarios, logs and tables."""

from dataclasses import replace

import numpy as np
import pytest

from idbench.experiments.identification.rates import Rates, moved
from idbench.identify import NoPrefilter, idbench_chain, paper_chain
from idbench.sim import load_scenario


def test_a_sine_moves_up_to_its_frequency():
    t = np.arange(0, 20, 0.01)
    assert moved(np.stack([np.sin(2 * np.pi * 0.5 * t), np.cos(2 * np.pi * 3.0 * t)]), 100.0) == pytest.approx(3.0, abs=0.05)


def test_a_joint_at_rest_does_not_count():
    """Its velocity is the noise of its encoder, which has power up to half the sampling frequency."""
    t, rng = np.arange(0, 20, 0.01), np.random.default_rng(0)
    assert moved(np.stack([np.sin(2 * np.pi * 0.5 * t), 1e-3 * rng.standard_normal(t.size)]), 100.0) < 1.0


def test_a_scenario_states_the_bandwidth_of_its_controller():
    """15 rad/s are 2.39 Hz."""
    assert load_scenario("ideal").wdyn == pytest.approx(15 / (2 * np.pi))


def test_the_papers_chain_obeys_the_papers_rules():
    """fs = 100 wdyn, wfp = 4 to 5 wdyn, wfq = 8 to 10 wdyn, for a motion of 1 Hz."""
    found = Rates.of(paper_chain(), 100.0, 800, 1.0, "as stated", np.zeros((2, 10)))
    assert str(found) == ("wdyn 1 Hz (as stated); fs 100 wdyn (100 Hz), wfp 4 wdyn (4 Hz), wfq 8 wdyn (8 Hz), n_d 10, rows 800")
    plain = replace(idbench_chain(), prefilter=NoPrefilter())
    assert "wfq" not in str(Rates.of(plain, 100.0, 800, 1.0, "as stated", np.zeros((2, 10))))


def test_identify_states_it(ran):
    assert "wdyn 2.39 Hz (of the scenario's controller)" in ran("run ideal --no-rerun -v --out run").out
    words = "--torque held --wdyn 2 --no-rerun --verbose"
    assert "wdyn 2 Hz (as stated); fs 50 wdyn" in ran("identify run/log.parquet", words).out
