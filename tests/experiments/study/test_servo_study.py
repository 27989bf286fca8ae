"""Studies of servos."""

import numpy as np
import pytest

from idbench.experiments.study.shard import run_shard
from idbench.experiments.study.study_file import load_study, study_from

SHORT = {
    "name": "short",
    "question": "?",
    "scenario": "servo",
    "settings": {"trajectory": {"steps": 8}, "drive": {"off": []}},
    "seeds": 2,
    "models": ["servo"],
    "friction": ["coulomb"],
    "axes": [{"field": "fs", "values": [100.0]}],
}


def test_studies_of_servos_ship():
    study = load_study("servo")
    assert study.of_servos
    assert "backlash1" in study.parameters
    assert len(load_study("servo-arm").parameters) == 6 * len(study.parameters) - 6


@pytest.mark.thorough
def test_rows_have_every_parameter_beside_its_truth():
    rows = run_shard(study_from(SHORT, "study"), range(2)).rows
    assert [row["failure"] for row in rows] == [None, None]
    for row in rows:
        assert row["a1"] == pytest.approx(row["a1.truth"], rel=0.02)
        assert row["delay1"] == pytest.approx(0.018, abs=0.001)
        assert 0 < row["a1.sigma"] < 0.02
        assert np.isnan(row["Fv1"])  # torque is never off: it shows as part of b


@pytest.mark.thorough
@pytest.mark.parametrize(("mass", "scaled"), [(0.0, False), (0.2, True)])
def test_torques_of_a_bare_horn_have_no_scale_and_those_with_a_known_mass_have(mass, scaled):
    axis = {"field": "payload.mass", "values": [mass]}
    payload = {"mass": mass, "position": [0.0, 0.0, -0.15]}
    study = study_from(SHORT | {"settings": {"robot": "horn", "payload": payload}, "axes": [axis], "seeds": 3}, "study")
    for row in run_shard(study, range(3)).rows:
        assert row["failure"] is None
        assert row["delay1"] == pytest.approx(row["delay1.truth"], abs=0.002)
        assert np.isfinite(row["a1"]) == scaled
        if scaled:
            assert row["a1"] == pytest.approx(row["a1.truth"], rel=0.03)


def test_a_joint_that_does_not_move_has_a_reason():
    still = SHORT | {"settings": {"trajectory": {"kind": "steps", "steps": 4, "reach": 0.001}}}
    rows = run_shard(study_from(still, "study"), range(2)).rows
    assert all("does not move" in row["failure"] for row in rows)
