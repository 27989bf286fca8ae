"""Studies that ask for the least error that noise allows."""

import json

import numpy as np
import pytest

from idbench.experiments.cli import main
from idbench.sim.encoders import AbstractEncoder, IncrementalEncoder
from idbench.sim.errors import ScenarioError


@pytest.mark.thorough
def test_the_bound_stands_beside_the_errors(tmp_path, capsys):
    """Of a study of nine runs: below the error of WLS, in the table, the summary and the report."""
    path = tmp_path / "small.toml"
    head = 'name = "small"\nquestion = "?"\nscenario = "ideal"\nseeds = 9\nmodels = ["explicit"]\n'
    head += 'estimators = ["WLS"]\nbound = true\n'
    body = '[settings]\nencoder = { kind = "incremental" }\ntorque = { noise = [0.1, 0.01] }\n[settings.trajectory]\n'
    moves = (
        'kind = "random"\nmoves = 6\ndurations = [0.9, 1.3]\nrest = 0.6\n[[axes]]\nfield = "encoder.lines"\nvalues = [2048]\n'
    )
    path.write_text(head + body + moves)
    assert main(["study", str(path), "--out", str(tmp_path / "out"), "--no-rerun"]) == 0
    assert "bound" in capsys.readouterr().out
    (cell,) = json.loads((tmp_path / "out" / "summary.json").read_text())["cells"]
    ratio = np.array(cell["rmse_percent"]) / cell["bound_percent"]
    assert (ratio > 0.5).all()  # nine runs know an rms to a quarter
    assert np.exp(np.mean(np.log(ratio))) > 1
    assert (np.array(cell["bound_through_reversals_percent"]) < cell["bound_percent"]).all()
    assert "<th>bound</th>" in (tmp_path / "out" / "report.html").read_text()


def test_an_encoder_that_does_not_say_what_noise_it_has_is_named():
    class Odd(AbstractEncoder):
        def start(self, n, samples, fs, rngs):
            raise NotImplementedError

    with pytest.raises(ScenarioError, match=r"encoder Odd has no spread\(2\), which a study with bound = true needs"):
        Odd().spread(2)


def test_counts_noise_and_converter_add_up():
    spread = IncrementalEncoder(lines=(1024, 4096), noise=1e-4).spread(2)
    np.testing.assert_allclose(spread, np.hypot(2 * np.pi / np.array([4096, 16384]) / np.sqrt(12), 1e-4))
