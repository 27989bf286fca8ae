"""Laws of friction: by name, by joint, those that a log asks for, those that masks hide, and smooth functions of velocity."""

import re
import runpy
from dataclasses import replace

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

import idbench
from idbench.experiments.errors import ExperimentError
from idbench.experiments.identification.friction_choice import hidden_laws
from idbench.experiments.identification.friction_laws import FrictionLaws
from idbench.experiments.identification.robot_model import RobotModel
from idbench.experiments.requests.shared import Parameters
from idbench.identify import BLOCKS, CHAINS, ExplicitModel, OfJoints, Problem, ReversalMask, identify, scara
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
def test_the_log_says_which_law(tmp_path, ran):
    """Stribeck friction is chosen, true to 4 sigma, said, summarized, drawn beyond the speeds of the log, and exported."""
    (tmp_path / "slow.toml").write_text(
        'name = "slow"\n[trajectory]\nkind = "random"\nmoves = 12\ndurations = [2.5, 2.5]\nrest = 1.0\n'
        '[torque]\nnoise = 0.01\n[encoder]\nkind = "incremental"\nlines = 16384\n'
        '[friction]\nkind = "stribeck"\nstatic = 1.6\nvelocity = 0.25\n'
    )
    found = ran("run slow.toml --out run --no-rerun --friction auto").summary
    assert {"Fst1", "vs1"} <= set(found["parameters"])
    explicit = found["models"]["explicit"]
    for name in ("Fst1", "vs1"):
        k = found["parameters"].index(name)
        x, sigma, true = explicit["estimate"][k], explicit["sigma"][k], found["truth"][k]
        assert abs(x - true) < 4 * sigma < 0.3 * true
    out, _, summary = ran("identify run --friction auto --model explicit --out found --no-rerun --write arm.py")
    assert re.search(r"friction of joint1: viscous \+ coulomb \+ stribeck \(stribeck explains \d+ %", out)
    assert {(c["joint"], c["law"]) for c in summary["friction"] if c["taken"]} >= {(1, "stribeck")}
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
    trajectory = {"kind": "random", "moves": 10, "durations": [2.0, 2.0], "rest": 1.0}
    scenario = from_dict({"name": "law", "trajectory": trajectory, "friction": friction})
    run = simulate(scenario)
    robot_model = RobotModel("scara", Parameters(friction=(name,)))
    truth = robot_model.truth(run.robots[0], scenario.friction)
    found = identify(run.alone(), robot_model.basis, ExplicitModel())
    for letters in ("Fst", "vs", "Fl", "off", "Fva", "FvT"):
        for key in (key for key in truth if key.startswith(letters) and truth[key]):
            assert found.X[found.names.index(key)] == pytest.approx(truth[key], rel=tolerance), key


def test_hysteresis_is_seen():
    """Dahl friction is below Coulomb's where a joint has just turned: the fit takes it for less friction than there is."""
    trajectory = {"kind": "random", "moves": 4, "durations": [1.0, 1.0], "rest": 1.0}
    dahl = {"kind": "dahl", "deflection": 0.02}
    run = simulate(from_dict({"name": "dahl", "trajectory": trajectory, "friction": dahl}))
    assert not run.failures
    found = identify(run.alone(), scara(), ExplicitModel())
    assert 0.3 < found.X[2] < 0.51


@pytest.mark.thorough
def test_the_delay_is_that_of_the_laws_that_were_chosen(tmp_path, ran):
    """Friction with load that is not in the model moves the delay by milliseconds; that in the model does not."""
    plain, late = load("ideal"), 0.005
    moves = RandomMoves(moves=12, durations=(0.8, 1.4), rest=0.2)
    log = simulate(replace(plain, trajectory=moves, friction=LoadDependent(share=0.1), fs=250.0)).alone()
    delayed = CubicSpline(log.t, log.tau)(np.maximum(log.t - late, log.t[0]))
    write_log(replace(log, tau=delayed), tmp_path / "log.parquet")
    words = "identify log.parquet --robot scara --torque-delay estimate --model explicit --no-rerun"
    first = ran(words, "--out plain").summary["torque"]["delay"]
    found = ran(words, "--friction auto --out chosen").summary
    then = float(re.search(r"that were chosen: ([-+.\de]+) ms", " ".join(found["notes"]))[1]) / 1e3
    assert found["torque"]["delay"] == pytest.approx(then, abs=1e-6)
    assert abs(first + late) > 1e-3
    assert abs(then + late) < 2e-4


@pytest.fixture(scope="module")
def plain():
    return simulate(load("ideal")).alone()


def problem(log, law, speed, **shapes):
    block = BLOCKS.create(law).at({name: np.array([x, x]) for name, x in shapes.items()})
    chain = CHAINS.create("idbench")
    masked = replace(chain, mask=replace(chain.mask, threshold=(speed,)))
    assert isinstance(masked.mask, ReversalMask)
    return Problem((log,), scara() + OfJoints(block, (0,)), ExplicitModel(), masked)


def test_stribeck_friction_below_the_mask_is_dropped_and_above_it_is_not(plain):
    for vs in (0.02, 0.005):  # from the latter nothing at all is left, not a smallest number
        near, far = (problem(plain, "stribeck", speed, vs=vs) for speed in (0.01, 0.2))
        assert set(hidden_laws(near, far)) == {"Fst1", "vs1"}
    assert hidden_laws(problem(plain, "stribeck", 0.02, vs=0.2), problem(plain, "stribeck", 0.2, vs=0.2)) == ()


def test_laws_of_all_speeds_stay_however_small_they_are(plain):
    shape = {"exponent": 3.0}
    assert hidden_laws(problem(plain, "power", 0.02, **shape), problem(plain, "power", 0.2, **shape)) == ()


CURVE = np.array([0.4, 0.08])
"""Size of a Stribeck curve that no standard law has [N m]."""


def log_of(seed, curve):
    rng = np.random.default_rng(seed)
    plain = simulate(replace(load("ideal"), trajectory=RandomMoves(seed=seed))).alone()
    qd = np.gradient(plain.q, 1 / plain.fs, axis=0)
    extra = curve * CURVE * np.exp(-((qd / 0.5) ** 2)) * np.sign(qd)
    return replace(plain, tau=plain.tau + extra + [0.02, 0.001] * rng.standard_normal(plain.tau.shape))


@pytest.fixture(scope="module")
def fits():
    logs = log_of(1, 1.0), log_of(2, 1.0)
    return {
        law: idbench.fit(logs[0], "scara", model="explicit", friction=law, validate=logs[1]) for law in ("standard", "smooth")
    }


def test_smooth_functions_find_what_standard_laws_miss(fits):
    """A Stribeck curve: the held-out error of both joints falls to a third at least."""
    percent = {
        law: np.array(f.summary()["validation"]["models"]["explicit"]["torque_error_percent"]) for law, f in fits.items()
    }
    assert (percent["smooth"] < percent["standard"] / 3).all()


def test_smooth_functions_are_small_where_nothing_is_missed():
    """Below a fiftieth of those that a curve needs, and the laws' parameters are what they were."""
    plain = {law: idbench.fit(log_of(1, 0.0), "scara", model="explicit", friction=law) for law in ("standard", "smooth")}
    assert (np.array(plain["smooth"].fit.request.smooth) < 0.02 * CURVE).all()
    for name in ("ZZR1", "ZZ2", "LMX2"):
        one, other = (f.parameters[name] for f in plain.values())
        assert one.value == pytest.approx(other.value, rel=0.02)


def test_smooth_functions_are_predicted_and_written(fits, tmp_path):
    fit = fits["smooth"]
    fit.write(tmp_path / "arm.py")
    arm, rng = runpy.run_path(str(tmp_path / "arm.py")), np.random.default_rng(0)
    q, qd, qdd = rng.normal(size=(3, 40, 2))
    np.testing.assert_allclose(arm["inverse_dynamics"](q, qd, qdd), fit.predict(q, qd, qdd), rtol=1e-6, atol=1e-6)
    assert "ZZR1" in repr(fit)
    assert "u1_1" not in repr(fit)
    with pytest.warns(UserWarning, match="smooth functions of friction have no place in the file"):
        fit.write(tmp_path / "arm.xml")


def test_smooth_functions_that_make_no_sense_are_refused():
    log = log_of(1, 0.0)
    with pytest.raises(ExperimentError, match="smooth stands alone"):
        idbench.fit(log, "scara", friction=("smooth", "1=standard+load"))
    with pytest.raises(ExperimentError, match="IV takes nothing that is known before"):
        idbench.fit(log, "scara", friction="smooth", estimator="IV")
    with pytest.raises(ExperimentError, match="smooth looks at a log"):
        idbench.load_robot("scara", friction="smooth").require_laws()
