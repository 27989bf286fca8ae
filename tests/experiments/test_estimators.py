"""Estimators that simulate, and physically consistent estimates, on the command line."""

import json
from dataclasses import replace

import numpy as np
import pytest

from idbench.experiments.cli import main
from idbench.identify.files.log_file import read_log, write_log
from idbench.sim.scenario.scenario_file import load, to_toml
from idbench.sim.trajectories import RandomMoves

pytestmark = pytest.mark.thorough

MOVES = RandomMoves(moves=8, durations=(1.3, 1.3), rest=0.7, seed=1)


@pytest.fixture(scope="module")
def scenario(tmp_path_factory):
    path = tmp_path_factory.mktemp("loop") / "quantized.toml"
    path.write_text(to_toml(replace(load("quantization"), trajectory=MOVES)))
    return path


@pytest.fixture(scope="module")
def loop_run(scenario):
    out = scenario.parent / "run"
    assert main(["run", str(scenario), "--out", str(out), "--no-rerun", "--estimator", "IV"]) == 0
    return out


def test_a_run_knows_its_own_loop_and_says_whether_noise_in_W_matters(ran, loop_run):
    summary = json.loads((loop_run / "summary.json").read_text())
    rounds = summary["iterations"]["explicit"]
    assert rounds["simulations"] <= 5
    assert rounds["noise_in_W"]["matters"] is False
    assert len(rounds["path"][0]) == 8
    out = ran("identify", loop_run, "--estimator DIDIM --start file --model explicit --no-rerun -v").out
    assert "explicit: converged after" in out
    assert "explicit: good" in out


def test_a_log_alone_needs_its_loop(idbench, loop_run, scenario, tmp_path):
    write_log(read_log(loop_run / "log.parquet"), tmp_path / "log.parquet")
    words = ("identify", tmp_path / "log.parquet", "--estimator", "DIDIM", "--model", "explicit")
    code, out, _ = idbench(*words, "--loop", scenario)
    assert code == 0
    assert "converged after" in out
    wrong = {
        (): "DIDIM simulates the closed loop in which a log was recorded, which is not known",
        ("--loop", scenario, "--estimator", "GLS"): "--loop: GLS simulates no loop",
        ("--start", "file", "--estimator", "WLS"): "--start file: WLS needs no start",
        ("--loop", scenario, scenario): "2 loops are given for 1 logs",
        ("--loop", "arm"): "it is none of scara",
        ("--loop", "ideal"): "the simulated motion of joint",
    }
    for more, message in wrong.items():
        start = words[:2] + words[4:] if "--estimator" in more else words
        code, _, err = idbench(*start, *more)
        assert code == 2
        assert message in err
        assert len(err.strip().splitlines()) == 1


def test_a_log_whose_loop_is_known_only_roughly_is_identified_by_instruments(idbench, ran, loop_run, tmp_path):
    """As of a real robot: the motion is that of the measured positions, the gains are anybody's, one law is not simulated."""
    log, own = read_log(loop_run / "log.parquet"), json.loads((loop_run / "summary.json").read_text())
    columns = np.column_stack([log.t, log.q])
    np.savetxt(tmp_path / "measured.csv", columns, delimiter=",", header="t,q1,q2", comments="")
    write_log(log, tmp_path / "log.parquet")
    (tmp_path / "loop.toml").write_text(
        f'name = "rough"\nrobot = "scara"\nfs = {log.fs}\n[trajectory]\nkind = "recorded"\nfile = "measured.csv"\n'
        'cutoff = 8.0\n[controller]\nkind = "pd"\nbandwidth = 12.0\n'
    )
    words = "identify log.parquet --loop loop.toml --model explicit --add offset --no-rerun"
    found = ran(words, "--estimator IV --out found").summary
    X = dict(zip(found["parameters"], found["models"]["explicit"]["estimate"], strict=True))
    sigma = dict(zip(found["parameters"], found["models"]["explicit"]["sigma"], strict=True))
    assert "off1" in X
    # Sigma does not contain the encoder's periodic errors, which LMY2 shows most.
    assert all(abs(X[name] - true) < 5 * sigma[name] for name, true in zip(own["parameters"], own["truth"], strict=True))
    code, _, err = idbench(*words.split(), "--estimator", "DIDIM")
    assert code == 2
    assert "off1, off2 cannot be simulated" in err


def test_a_loop_that_is_believed_and_wrong_is_told(ran, loop_run, scenario, tmp_path):
    """A controller twice as stiff: DIDIM says that least squares does not agree. Of the true loop it says nothing."""
    wrong = tmp_path / "wrong.toml"
    wrong.write_text(scenario.read_text().replace("bandwidth = 15.0", "bandwidth = 30.0"))
    assert wrong.read_text() != scenario.read_text()
    words = ("identify", loop_run / "log.parquet", "--estimator DIDIM --model explicit --no-rerun --loop")
    assert "sigma away from least squares of the measured motion" in " ".join(ran(*words, wrong).out.split())
    assert "away from least squares" not in ran(*words, scenario).out


def test_one_model_that_cannot_takes_nothing_from_the_others(ran, loop_run):
    """CLIE compares torques: implicit and power models have no estimate, and say so."""
    out = ran("identify", loop_run, "--estimator UKF --no-rerun").out
    assert "power: no estimate: UKF has the robot's equation" in " ".join(out.split())
    assert "ZZR1" in out


def test_links_may_be_near_those_of_the_file(ran, loop_run, tmp_path):
    """The run's first 4 s: with the file's links the inertias are 3 times better known, and their sigma says it."""
    log = read_log(loop_run / "log.parquet")
    rng = np.random.default_rng(3)
    noisy = replace(log, tau=log.tau + [2.0, 0.1] * rng.standard_normal(log.tau.shape))
    write_log(noisy.part(0, 700), tmp_path / "short.parquet")
    words = "identify short.parquet --model explicit --no-rerun"
    free = ran(words, "--out free").summary
    out, _, near = ran(words, "--prior file:5% Fs2=0.1:10% --out near")
    assert "roughly known: file:5%, Fs2=0.1:10%" in out
    names = free["parameters"]
    sigma = [np.array(x["models"]["explicit"]["sigma_noise"]) for x in (free, near)]
    k = names.index("ZZ2")
    assert sigma[1][k] < sigma[0][k]
    assert sigma[1][names.index("Fs2")] <= 0.0101
    assert near["prior"] == ["file:5%", "Fs2=0.1:10%"]
    assert "as the log decides" in ran(words, "--prior file").out


def test_a_base_parameter_may_be_roughly_known_and_a_short_log_loses_nothing(ran, loop_run, tmp_path):
    """Three seconds, all models: Cond(W) of one of them is infinite, which JSON has no word for."""
    write_log(read_log(loop_run / "log.parquet").part(100, 470), tmp_path / "short.parquet")
    found = ran("identify short.parquet --model all --no-rerun --no-trials --prior file ZZR1=3.5:10% --out short").summary
    k = found["parameters"].index("ZZR1")
    assert found["models"]["explicit"]["sigma_noise"][k] <= 0.351
