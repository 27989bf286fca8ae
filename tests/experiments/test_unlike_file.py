"""Torques far from those of the robot's file: whether units, friction or links are what differs."""

from dataclasses import replace

import numpy as np
import pytest

from idbench.experiments.identification.log_warnings import without_shapes
from idbench.identify import BLOCKS, ExplicitModel, MotionLog, NoMask, Problem, TorqueChannel, idbench_chain, scara


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("factors", "said"),
    [
        ({"damping": 1, "density": 1}, None),
        ({"damping": 1e4, "density": 1}, "are the file's values of friction placeholders?"),
        ({"damping": 1, "density": 1e3}, "are the file's values of links and rotors placeholders?"),
        ({"damping": 1e3, "density": 1e3}, "are they in N m?"),
    ],
)
def test_what_of_the_file_differs_is_said(four_joints, tmp_path, ran, factors, said):
    text = (four_joints / "arm.xml").read_text()
    text = text.replace('damping="0.1"', f'damping="{0.1 * factors["damping"]:g}"')
    (tmp_path / "arm.xml").write_text(text.replace("<geom", f'<geom density="{1000 * factors["density"]:g}"'))
    words = "--robot arm.xml --torque instantaneous --model explicit --estimator WLS --no-rerun"
    warnings = ran("identify", four_joints / "log.csv", words).out
    assert ("times what the robot's file says" in warnings) == (said is not None)
    assert said is None or said in warnings


def test_what_makes_a_law_linear_is_no_torque_of_the_log():
    """Rows of a law contain F0 dg/db b0, which is far larger than what is measured where the shape is open."""
    rng, chain = np.random.default_rng(0), replace(idbench_chain(), mask=NoMask())
    log = MotionLog(
        100.0, np.cumsum(rng.normal(size=(500, 2)), axis=0) / 50, rng.normal(size=(500, 2)), TorqueChannel("instantaneous")
    )
    steep = replace(BLOCKS.create("arctan"), size=1e4, values={"vat": 4.0})
    plain, shaped = (Problem((log,), basis, ExplicitModel(), chain) for basis in (scara(), scara() + steep))
    measured = np.linalg.norm(plain.factors.R[..., -1])
    assert np.linalg.norm(shaped.factors.R[..., -1]) > 100 * measured
    np.testing.assert_allclose(np.linalg.norm(without_shapes(shaped)[..., -1]), measured, rtol=1e-9)
