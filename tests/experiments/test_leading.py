"""Tables of many joints: one model leads, the others have a line each; asked for, they are shown whole."""

import json

import numpy as np
import pytest

from idbench.experiments.cli import main


@pytest.mark.parametrize("asked", [[], ["--model", "all"], ["--model", "power"]])
def test_one_model_is_shown_if_no_other_is_asked_for(four_joints, asked, tmp_path, capsys):
    assert (
        main(
            [
                "identify",
                str(four_joints / "log.csv"),
                "--robot",
                str(four_joints / "arm.xml"),
                "--torque",
                "instantaneous",
                *asked,
                "--no-rerun",
                "--out",
                str(tmp_path / "found"),
            ]
        )
        == 0
    )
    lines = capsys.readouterr().out.splitlines()
    names = json.loads((tmp_path / "found" / "summary.json").read_text())["parameters"]
    rows = [line for line in lines if line.split() and line.split()[0] in names]
    assert len(rows) == (len(names) if "all" in asked else np.ceil(len(names) / 3))  # three parameters beside each other
    assert sum(line.count(" model") for line in lines if line.startswith("other models differ: ")) == (not asked)
    assert asked or len(lines) <= 32
