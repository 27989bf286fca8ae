"""Models and chains of a user's own, named on the command line."""

import json

import pytest

from idbench.experiments.errors import ExperimentError
from idbench.experiments.identification.chain_settings import chain_of
from idbench.identify import BLOCKS, CHAINS, ESTIMATORS, MODELS

OWN = '''
from dataclasses import dataclass, replace
import numpy as np
from idbench.identify import CHAINS, AbstractEstimator, AbstractFriction, Estimate, ExplicitModel, FirLowPass

class Steady(ExplicitModel):
    """The explicit model, by another name."""

def slow():
    return replace(CHAINS.create("idbench"), operator=FirLowPass(cutoff=6.0))

explicit = Steady

@dataclass(frozen=True)
class Ridge(AbstractEstimator):
    """Least squares with a penalty."""

    def solve(self, problem):
        W, Y = problem.rows.W, problem.rows.Y
        Wt = np.swapaxes(W, -1, -2)
        return Estimate.judge(problem, np.linalg.solve(Wt @ W + 1e-9 * np.eye(W.shape[-1]), Wt @ Y[..., None])[..., 0])

@dataclass(frozen=True)
class Drag(AbstractFriction):
    """Fq |qd| qd."""

    symbol = "Fq"
    unit = "N m s^2/rad^2"

    def force(self, q, qd):
        return np.abs(qd) * qd
'''


@pytest.fixture
def own(tmp_path, monkeypatch):
    """Two parts of a user's own, in a module, and the tables without them afterwards."""
    (tmp_path / "own_parts.py").write_text(OWN)
    monkeypatch.syspath_prepend(tmp_path)
    yield
    for table in (MODELS, CHAINS, ESTIMATORS, BLOCKS):
        table._loaded.clear()


def test_a_model_and_a_chain_of_ones_own_are_named_on_the_command_line(own, idbench, logs, tmp_path):
    words = ["identify", logs / "first.parquet", "--robot", "puma560", "--torque", "held", "--no-rerun", "--out", "found"]
    code, _, complaint = idbench(*words, "--model", "own_parts:Steady", "--chain", "own_parts:slow")
    assert code == 0, complaint
    shown = json.loads((tmp_path / "found" / "summary.json").read_text())
    assert set(shown["models"]) == {"Steady"}
    assert shown["chain"] == "slow"


@pytest.mark.thorough
def test_estimators_and_laws_of_ones_own_are_named_in_every_command(own, idbench, logs, tmp_path):
    words = ["--friction", "standard+own_parts:Drag", "--estimator", "own_parts:Ridge"]
    known = ["--robot", "puma560", "--torque", "held", "--model", "explicit", "--no-rerun", "--out", "found"]
    code, _, complaint = idbench("identify", logs / "first.parquet", *known, *words)
    assert code == 0, complaint
    found = json.loads((tmp_path / "found" / "summary.json").read_text())
    assert (found["estimator"], "Fq6" in found["parameters"]) == ("Ridge", True)
    assert "own_parts:Ridge" in (tmp_path / "found" / "report.html").read_text()  # how to make it again
    code, _, complaint = idbench("run", "ideal", "--add", "own_parts:Drag", "--estimator", "own_parts:Ridge", "--no-rerun")
    assert code == 0, complaint
    code, out, complaint = idbench("robot", "scara", "--add", "own_parts:Drag")
    assert (code, "Fq2" in out) == (0, True), complaint


@pytest.mark.parametrize(
    ("place", "said"),
    [
        ("own_parts:Nothing", "own_parts:Nothing cannot be loaded: AttributeError"),
        ("nowhere:Model", "nowhere:Model cannot be loaded: ModuleNotFoundError"),
        ("own_parts:explicit", "explicit is built into the models, or installed: rename the class"),
        ("own_parts:slow", "makes Chain, not AbstractModel"),
    ],
)
def test_what_cannot_be_a_model_is_said(own, place, said, complaint):
    assert said in complaint("identify", "log.csv", "--torque", "held", "--model", place)


def test_a_file_names_no_code(own, tmp_path):
    (tmp_path / "chain.toml").write_text('chain = "own_parts:slow"\n')
    with pytest.raises(ExperimentError, match="no 'own_parts:slow' among the chains"):
        chain_of(tmp_path / "chain.toml")
    (tmp_path / "chain.toml").write_text('[operator]\nkind = "own_parts:Steady"\n')
    with pytest.raises(ExperimentError, match="no 'own_parts:Steady' among the operators"):
        chain_of(tmp_path / "chain.toml")
