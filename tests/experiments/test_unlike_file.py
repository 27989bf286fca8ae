"""Torques far from those of the robot's file: whether units, friction or links are what differs."""

import pytest

from experiments.cli import main


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
def test_what_of_the_file_differs_is_said(four_joints, tmp_path, capsys, factors, said):
    text = (four_joints / "arm.xml").read_text()
    text = text.replace('damping="0.1"', f'damping="{0.1 * factors["damping"]:g}"')
    (tmp_path / "arm.xml").write_text(text.replace("<geom", f'<geom density="{1000 * factors["density"]:g}"'))
    words = ["identify", str(four_joints / "log.csv"), "--robot", str(tmp_path / "arm.xml"), "--torque", "instantaneous"]
    assert main([*words, "--model", "explicit", "--estimator", "WLS", "--no-rerun", "--out", str(tmp_path / "found")]) == 0
    warnings = capsys.readouterr().out
    assert ("times what the robot's file says" in warnings) == (said is not None)
    assert said is None or said in warnings
