"""Laws of friction on the command line: by name, by joint, and those that a log asks for."""

import json
import re
from dataclasses import replace

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from idbench.experiments.cli import main
from idbench.experiments.identification.friction_laws import FrictionLaws
from idbench.identify import OfJoints
from idbench.identify.basis import StribeckFriction
from idbench.identify.files.log_file import write_log
from idbench.sim.engine.simulation import simulate
from idbench.sim.frictions import LoadDependent
from idbench.sim.scenario.scenario_file import from_dict, load
from idbench.sim.trajectories import RandomMoves

JOINTS = ("hip", "knee")


def test_laws_are_named_for_all_joints_or_for_one():
    assert FrictionLaws.of((), JOINTS).names == (("viscous", "coulomb"),) * 2
    found = FrictionLaws.of(("asymmetric", "knee=standard+load", "1=none"), JOINTS)
    assert found.names == ((), ("viscous", "coulomb", "load"))
    assert not found.standard
    assert all(isinstance(block, OfJoints) and block.joints == (1,) for block in found.blocks())
    assert FrictionLaws.of(found.texts(JOINTS), JOINTS) == found
    numbers = ("2", "joint 1")  # of which the first is called like the number of the second
    assert FrictionLaws.of(found.texts(numbers), numbers) == found
    assert FrictionLaws.of(("auto",), JOINTS).auto
    (block,) = FrictionLaws.of(("stribeck:0.2",), JOINTS).blocks()
    assert block == StribeckFriction(0.2)


@pytest.mark.thorough
def test_the_log_says_which_law(tmp_path, monkeypatch, capsys):
    """Stribeck friction is chosen, true to 4 sigma, said, summarized, drawn beyond the speeds of the log, and exported."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "slow.toml").write_text(
        'name = "slow"\n[trajectory]\nkind = "random"\nmoves = 12\ndurations = [2.5, 2.5]\nrest = 1.0\n'
        '[torque]\nnoise = 0.01\n[encoder]\nkind = "incremental"\nlines = 16384\n'
        '[friction]\nkind = "stribeck"\nstatic = 1.6\nvelocity = 0.25\n'
    )
    assert main(["run", "slow.toml", "--out", "run", "--no-rerun", "--friction", "auto"]) == 0
    found = json.loads((tmp_path / "run" / "summary.json").read_text())
    assert {"Fst1", "vs1"} <= set(found["parameters"])
    explicit = found["models"]["explicit"]
    for name in ("Fst1", "vs1"):
        k = found["parameters"].index(name)
        x, sigma, true = explicit["estimate"][k], explicit["sigma"][k], found["truth"][k]
        assert abs(x - true) < 4 * sigma < 0.3 * true
    capsys.readouterr()
    assert (
        main(
            [
                "identify",
                "run",
                "--friction",
                "auto",
                "--model",
                "explicit",
                "--out",
                "found",
                "--no-rerun",
                "--write",
                "arm.py",
            ]
        )
        == 0
    )
    out = capsys.readouterr().out
    assert re.search(r"friction of joint1: viscous \+ coulomb \+ stribeck \(stribeck explains \d+ %", out)
    compared = json.loads((tmp_path / "found" / "summary.json").read_text())["friction"]
    assert {(c["joint"], c["law"]) for c in compared if c["taken"]} >= {(1, "stribeck")}
    assert "beyond the speeds of the log" in (tmp_path / "found" / "report.html").read_text()
    module: dict = {}
    exec((tmp_path / "arm.py").read_text(), module)  # what a controller would import
    slow, fast = (module["inverse_dynamics"](np.zeros(2), np.array([v, 0.0]), np.zeros(2))[0] for v in (1e-3, 2.0))
    assert slow == pytest.approx(0.8, rel=0.1)
    assert fast == pytest.approx(0.6, rel=0.1)


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("friction", "name", "tolerance"),
    [
        ({"kind": "asymmetric", "offset": 0.05, "difference": 0.01}, "asymmetric", 0.01),
        ({"kind": "load", "share": 0.1}, "standard+load", 0.02),
        ({"kind": "warming", "slope": -0.002, "time": 10.0}, "standard+temperature", 0.01),
        ({"kind": "stribeck", "static": 1.6, "velocity": 0.25}, "standard+stribeck", 0.01),
    ],
)
def test_simulated_laws_are_identified(friction, name, tolerance):
    """Without noise, to what the physics step leaves of loads, and reversals of slow joints."""
    from idbench.experiments.identification.robot_model import RobotModel
    from idbench.experiments.requests.shared import Parameters
    from idbench.identify import ExplicitModel, identify

    trajectory = {"kind": "random", "moves": 10, "durations": [2.0, 2.0], "rest": 1.0}
    scenario = from_dict({"name": "law", "trajectory": trajectory, "friction": friction})
    run = simulate(scenario)
    robot_model = RobotModel("scara", Parameters(friction=(name,)))
    truth = robot_model.truth(run.robots[0], scenario.friction)
    found = identify(run.alone(), robot_model.basis, ExplicitModel())
    for letters in ("Fst", "vs", "Fl", "off", "Fva", "FvT"):
        for key in (key for key in truth if key.startswith(letters) and truth[key]):
            assert found.X[found.names.index(key)] == pytest.approx(truth[key], rel=tolerance), key


def test_hysteresis_is_seen(tmp_path):
    """Dahl friction is below Coulomb's where a joint has just turned: the fit takes it for less friction than there is."""
    del tmp_path
    trajectory = {"kind": "random", "moves": 4, "durations": [1.0, 1.0], "rest": 1.0}
    dahl = {"kind": "dahl", "deflection": 0.02}
    run = simulate(from_dict({"name": "dahl", "trajectory": trajectory, "friction": dahl}))
    assert not run.failures
    from idbench.identify import ExplicitModel, identify, scara

    found = identify(run.alone(), scara(), ExplicitModel())
    assert 0.3 < found.X[2] < 0.51


@pytest.mark.thorough
def test_the_delay_is_that_of_the_laws_that_were_chosen(tmp_path, capsys):
    """Friction with load that is not in the model moves the delay by milliseconds; that in the model does not."""
    plain, late = load("ideal"), 0.005
    moves = RandomMoves(moves=12, durations=(0.8, 1.4), rest=0.2)
    log = simulate(replace(plain, trajectory=moves, friction=LoadDependent(share=0.1), fs=250.0)).alone()
    delayed = CubicSpline(log.t, log.tau)(np.maximum(log.t - late, log.t[0]))
    write_log(replace(log, tau=delayed), tmp_path / "log.parquet")
    words = ["identify", str(tmp_path / "log.parquet"), "--robot", "scara", "--torque-delay", "estimate", "--model", "explicit"]
    assert main([*words, "--json", "--no-rerun"]) == 0
    first = json.loads(capsys.readouterr().out)["torque"]["delay"]
    assert main([*words, "--friction", "auto", "--json", "--no-rerun"]) == 0
    found = json.loads(capsys.readouterr().out)
    then = float(re.search(r"that were chosen: ([-+.\de]+) ms", " ".join(found["notes"]))[1]) / 1e3
    assert found["torque"]["delay"] == pytest.approx(then, abs=1e-6)
    assert abs(first + late) > 1e-3
    assert abs(then + late) < 2e-4
